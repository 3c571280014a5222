"""The search, the journal, the ensemble and the page of a calibration."""

import json
import sqlite3
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from khr_analysis import outcome_measures
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario import robots
from khr_common import KhrError, RunError
from khr_studies.calibration import search as calibration_search
from khr_studies.calibration.ensemble import (
    constant_spreads,
    ensemble,
    ensemble_members,
    missed_rows,
    pareto_set,
    worst_miss,
)
from khr_studies.calibration.figure import correlation_figure
from khr_studies.calibration.objective import Candidate
from khr_studies.calibration.page import page, write
from khr_studies.calibration.plan import FreeConstant
from khr_studies.calibration.search import (
    Journal,
    Measurement,
    Proposals,
    Search,
    cost_digest,
    physics_digest,
    run_search,
)
from khr_studies.calibration.study import Calibration, calibration_of, confirm, measure_shipped
from khr_studies.measuring.ensemble_file import read_ensemble, spread_of
from khr_studies.measuring.json_file import read_json, write_json
from tests import ROOT
from tests.fakes.robots import PLAN, TITLES, measure, measured, robot

SEARCH = Search(PLAN, 'mujoco', 0, 1, 6, 30)


@pytest.fixture
def here(monkeypatch):
    """Let the search compute in this process, in reverse order; return how often it measured."""
    measured = []

    def compute(pool, function, tasks):
        for key, task in reversed(list(tasks)):
            measured.append(task)
            yield [(key, function(task))]

    monkeypatch.setattr(calibration_search, 'compute', compute)
    monkeypatch.setattr(calibration_search, 'measure_robot', measure)
    monkeypatch.setattr(calibration_search, 'physics_digest', lambda *_: 'invented')
    return measured


def searched(path, made=SEARCH):
    """Search with a journal; return every candidate of it."""
    with Journal(path, made.head) as book:
        return run_search(made, Measurement(book, None))


def test_search_finds_what_the_rows_want_from_anywhere_in_the_ranges(tmp_path, here):
    robots = searched(tmp_path / 'journal', replace(SEARCH, candidates=150))
    assert len(robots) >= 150
    first = [PLAN.constants['sway'].share(one.constants['sway']) for one in robots[:24]]
    assert min(first) < 0.1 and max(first) > 0.9, 'it begins in the whole of the range'
    best = min(robots, key=lambda robot: robot.cost)
    assert best.cost < 0.05 < robots[0].cost
    assert best.constants['sway'] == pytest.approx(0.025, abs=0.001)


def test_placed_candidates_are_in_the_first_generation(tmp_path, here):
    placed = {'sway': 0.0125, 'board': 0.2, 'lift': 0.02}
    plan = replace(PLAN, placed=(placed,))
    first = Proposals(replace(SEARCH, plan=plan)).ask()
    assert first[0] == pytest.approx(placed, rel=1e-3) and len(first) == 1 + 4 * SEARCH.population


def test_added_candidates_are_measured_and_do_not_steer_the_search(tmp_path, here):
    one = {'sway': 0.0251, 'board': 0.2, 'lift': 0.02}  # better than all of the search
    before = searched(tmp_path / 'journal')
    with_one = replace(SEARCH, plan=replace(PLAN, added=(one,)))
    assert with_one.head == SEARCH.head
    after = searched(tmp_path / 'journal', with_one)
    assert [robot.constants for robot in after] == [*(robot.constants for robot in before), one]
    assert searched(tmp_path / 'other', with_one) == after


def test_whole_constant_takes_whole_numbers_of_its_range():
    constant = FreeConstant(('hip_controller.rate_delay',), (1.0, 3.0), '', whole=True)
    assert {constant.at(share) for share in np.linspace(0.0, 1.0, 50)} == {1.0, 2.0, 3.0}
    plan = replace(PLAN, constants={'delay': constant})
    ((_, value),) = plan.changes({'delay': 2.0})
    assert type(value) is int


def test_generations_are_measured_with_other_seeds(tmp_path, here):
    searched(tmp_path / 'journal', replace(SEARCH, seeds=2, candidates=40))
    assert {task.seeds for task in here[:24]} == {(0, 1)} != {here[-1].seeds}


def test_search_that_was_interrupted_goes_on_as_if_it_had_not_been(tmp_path, here):
    whole, cut = tmp_path / 'whole', tmp_path / 'cut'
    expected = searched(whole)
    with Journal(cut, SEARCH.head) as book:
        for one in expected[:8]:
            book.add(one)
    here.clear()
    found = searched(cut)
    assert {str(one.constants) for one in found} == {str(one.constants) for one in expected}
    assert len(here) == len(expected) - 8
    here.clear()
    searched(whole)
    assert here == [], 'a finished search measures nothing again'


def test_journal_of_another_search_or_of_other_physics_is_refused(tmp_path, here, monkeypatch):
    journal = tmp_path / 'journal'
    searched(journal)
    with pytest.raises(KhrError, match='seeds'):
        searched(journal, replace(SEARCH, seeds=3))
    monkeypatch.setattr(calibration_search, 'physics_digest', lambda *_: 'other')
    with pytest.raises(KhrError, match=r"physics: .*'invented'.*, now .*'other'"):
        searched(journal)
    journal.write_text('{"no": "journal"}\n')
    with pytest.raises(KhrError, match='not a journal'):
        searched(journal)


@pytest.mark.slow
def test_physics_digest_changes_with_settings_and_with_the_measure_of_vibration(monkeypatch):
    slick = replace(PLAN, settings={'simulator.servo_friction': 0.1})
    known = physics_digest(PLAN, 'mujoco')
    assert physics_digest(PLAN, 'mujoco') == known != physics_digest(slick, 'mujoco')
    monkeypatch.setattr(outcome_measures, 'ORDER', 2)
    assert physics_digest(PLAN, 'mujoco') != known


def test_the_best_are_confirmed_on_both_engines_and_cost_what_the_worse_one_says(tmp_path, here):
    robots = searched(tmp_path / 'journal')
    here.clear()
    with Journal(tmp_path / 'journal', SEARCH.head) as book:
        found = confirm(SEARCH, robots, 3, Measurement(book, None))
        again = confirm(SEARCH, robots, 3, Measurement(book, None))
        assert len(book.candidates('confirmed')) == 3
    assert [task.engines for task in here] == [('mujoco', 'bullet')] * 3, 'and not twice'
    assert {(task.seeds, task.prune_above) for task in here} == {((0, 1, 2), float('inf'))}
    assert again == found and len(found) == 3
    one = {'sway': 0.0251, 'board': 0.2, 'lift': 0.02}
    with Journal(tmp_path / 'journal', SEARCH.head) as book:
        refined = replace(SEARCH, plan=replace(PLAN, refined=(one,)))
        assert confirm(refined, robots, 3, Measurement(book, None))[-1].constants == one
    better, worse = robot(0.025), robot(0.027)
    both = replace(better, values={**worse.values, 'bullet': better.values['mujoco']})
    assert both.value(TITLES[0]) == pytest.approx(6.1)
    assert worst_miss(PLAN, both) == worst_miss(PLAN, worse) > worst_miss(PLAN, better)


def test_a_candidate_is_pruned_above_the_parents_of_the_next_generation():
    proposals = Proposals(SEARCH)
    number = len(proposals.ask())
    before = proposals.prune_above
    pruned = [Candidate({}, cost=float(each)) for each in range(number)]
    proposals.tell(pruned)
    assert proposals.prune_above == before, 'their costs are estimates'
    proposals.tell([replace(each, complete=True) for each in pruned])
    assert proposals.prune_above == SEARCH.population // 2 - 1 < before


def many(count):
    generator = np.random.default_rng(0)
    return [
        robot(0.025 + 0.0005 * generator.standard_normal(), 0.2, generator.uniform(0.01, 0.03))
        for _ in range(count)
    ]


def test_ensemble_holds_what_fits_and_tells_open_constants_from_determined_ones():
    lost = [robot(0.04), robot(lasted=0.5), robot(complete=False)]
    found = ensemble(PLAN, [*lost, *many(30)])
    assert found.tolerances == 1.0 and len(found.fitting) == 30 == len(found.robots)
    assert (found.candidates, found.complete) == (33, 31)
    assert found.best.cost == min(one.cost for one in found.robots)
    spreads = constant_spreads(PLAN, found)
    assert spreads['open']['lift'] and not spreads['open']['sway']


def test_ensemble_of_few_that_fit_states_the_tolerance_it_needs(monkeypatch):
    monkeypatch.setattr('khr_studies.calibration.ensemble.LEAST', 6)
    wide = [robot(0.025 + 0.001 * step, lift=0.01 + 0.001 * step) for step in range(8)]
    found = ensemble(PLAN, wide)
    assert len(found.robots) == 6
    assert found.tolerances == pytest.approx(max(worst_miss(PLAN, one) for one in found.robots))
    assert found.tolerances > 1.0


def test_ensemble_counts_added_robots_and_those_that_differ_in_one_constant_as_one():
    family = [robot(0.025, lift=0.01 + 0.001 * step) for step in range(4)]
    other = robot(0.0251, lift=0.02)
    found = ensemble(PLAN, [*family, other])
    assert len(found.fitting) == 5
    assert [one.constants['sway'] for one in found.robots] == [0.025, 0.0251]
    plan = replace(PLAN, added=(family[0].constants, other.constants))
    assert len(ensemble(plan, [family[0], other]).robots) == 1


def test_shipped_journal_was_measured_by_the_present_cost():
    with sqlite3.connect(ROOT / 'docs' / 'calibration.sqlite') as database:
        ((head,),) = database.execute("SELECT data FROM results WHERE id = ''")
    assert json.loads(head)['cost'] == cost_digest(), 'khr calibrate does not resume from it'


def test_correlations_of_a_constant_that_is_the_same_in_every_robot_are_blank():
    same, *others = PLAN.constants
    values = {name: np.arange(3.0) for name in others} | {same: np.ones(3)}
    figure = correlation_figure(PLAN, SimpleNamespace(robots=[0, 1, 2], values=values.__getitem__))
    assert len(figure.axes[0].texts) == len(others) * (len(others) - 1)


def test_page_data_pictures_and_constants_are_written(tmp_path):
    robots = many(25)
    out = tmp_path / 'calibration.md'
    found = calibration_of(SEARCH, robots)
    assert '25 candidates; the best: ' in write(found, robots, out)
    assert {path.name for path in tmp_path.iterdir()} == {
        'calibration.md',
        'calibration.json',
        'calibration.yaml',
        'calibration_correlations.png',
        'calibration_frontier.png',
    }
    text = out.read_text()
    assert text == page(found, 'calibration')
    for words in ('leave it open', 'determine it', 'derived: 0.2 to 0.3', '25 candidates'):
        assert words in ' '.join(text.split())
    fitted = yaml.safe_load(out.with_suffix('.yaml').read_text())
    assert fitted['gait']['ros__parameters']['sway'] == found.best.constants['sway']
    assert page(read_json(out.with_suffix('.json'), Calibration), 'calibration') == text
    with pytest.raises(RunError, match='raise --candidates'):
        calibration_of(SEARCH, [robot(complete=False)])


def limited(*limits):
    """Return a robot with these limits, deg."""
    values = {title: [limit] for title, limit in zip(TITLES, limits, strict=True)}
    return measured(robot().constants, {**values, PLAN.walks[0].title: [1.0]})


def test_the_robot_that_misses_the_fewest_rows_is_chosen_even_at_a_higher_cost(monkeypatch):
    tolerance = PLAN.limits[0].tolerance_deg
    one_far = limited(5.9, 9.2 + 2.0 * tolerance)
    both_near = limited(5.9 + 1.05 * tolerance, 9.2 + 1.05 * tolerance)
    assert one_far.cost > both_near.cost
    assert [len(missed_rows(PLAN, each)) for each in (one_far, both_near)] == [1, 2]
    assert calibration_of(SEARCH, [both_near, one_far]).best == one_far
    monkeypatch.setattr('khr_studies.calibration.ensemble.LEAST', 1)  # one that fits is enough
    found = ensemble(PLAN, [both_near, one_far])
    assert found.fitting == (one_far, both_near) and found.best == one_far
    assert worst_miss(PLAN, one_far) > found.tolerances >= worst_miss(PLAN, both_near)


def test_pareto_set_trades_limits_for_the_other_rows():
    good = robot()
    slower = limited(6.3, 9.2)
    falls = robot(lasted=0.5)
    assert pareto_set(PLAN, [slower, falls, good]) == (good,)
    lame = robot(lasted=0.9)
    assert pareto_set(PLAN, [lame, slower]) == (lame, slower)


def test_a_shipped_robot_is_measured_with_the_best_and_shown_but_never_chosen(
    tmp_path, here, monkeypatch
):
    monkeypatch.setattr(robots, 'ROBOTS', tmp_path)
    file = tmp_path / 'soft.yaml'
    file.write_text('simulator:\n  ros__parameters:\n    friction_smooth: 0.24\n')
    search = replace(SEARCH, plan=replace(PLAN, robots=('soft',)))
    assert search.head == SEARCH.head, 'a journal stays valid'
    with Journal(tmp_path / 'journal', search.head) as book:
        shipped = measure_shipped(search, Measurement(book, None))
    assert shipped['soft'].constants['board'] == 0.24, 'of its file'
    assert shipped['soft'].constants['lift'] == GaitParameters().lift, 'its default'
    assert here[-1].engines == search.engines and here[-1].seeds == (0, 1, 2)
    better = calibration_of(search, [limited(5.9, 12.0)], shipped={'soft': robot()})
    assert better.best == limited(5.9, 12.0) and better.found.robots == [better.best]
    assert '| row | wanted | chosen, mujoco | soft, mujoco |' in page(better)
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: 20.0\n')
    with pytest.raises(
        KhrError, match=r"'soft': simulator.gear_stiffness of 20.0 is not accepted"
    ):
        measure_shipped(search, Measurement(book, None))


def test_a_row_missed_is_searched_among_all_candidates():
    """Of three robots the best misses the second row; the one that meets it misses the first."""
    robots = [limited(5.9, 12.0), limited(9.0, 9.2), limited(9.0, 12.0)]
    robots.append(replace(limited(9.0, 9.2), complete=False))
    (row,) = calibration_of(SEARCH, robots).resisting
    assert (row.row, row.meeting, row.candidates) == (TITLES[1], 1, 3)
    assert row.missed == (TITLES[0],)
    (none,) = calibration_of(SEARCH, [limited(5.9, 12.0)]).resisting
    assert none.meeting == 0 and none.missed == ()


@pytest.mark.slow
def test_ensemble_is_written_with_what_each_robot_has_and_read_again(tmp_path):
    path = tmp_path / 'ensemble.json'
    robots = [robot(sway=0.025), robot(sway=0.0255, lift=0.01)]
    write_json(path, ensemble_members(PLAN, ensemble(PLAN, robots)))
    kept = read_ensemble(path)
    assert [member.constants['gait.sway'] for member in kept] == [0.025, 0.0255]
    assert spread_of(kept)[TITLES[0]] == pytest.approx((5.9, 6.0))
    path.write_text('{}')
    with pytest.raises(KhrError, match='not an ensemble'):
        read_ensemble(path)
