"""The calibration: its plan, its objective, its search, its ensemble, and the defaults."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.node_registry import table_of
from khr_common import KhrError, RunError, check, specifications
from khr_experiments import calibration_objective, calibration_search
from khr_experiments.calibration import CONSTANTS, Calibration, differences, parameter_file
from khr_experiments.calibration_objective import (
    FALL,
    REACH,
    Task,
    limit_near,
    measure_robot,
    row_costs,
    walk_cost,
)
from khr_experiments.calibration_plan import FreeConstant, read_plan
from khr_experiments.calibration_search import Search, best_of, read_journal, search
from khr_experiments.critical import RIDES
from khr_experiments.ensemble import determined, ensemble, thinned, worst_miss
from khr_experiments.ensemble_file import read_ensemble, spread_of, write_ensemble
from khr_experiments.errors import ExperimentError
from khr_experiments.json_file import read_json
from khr_experiments.published import LIMITS
from khr_report.calibration_page import Request, page, write
from tests import ROOT
from tests.fakes.benches import outcome
from tests.fakes.robots import PLAN, TITLES, measure, robot

SEARCH = Search(PLAN, 'mujoco', 0, 1, 6, 30, PLAN.defaults)


def test_shipped_plan_moves_parameters_within_their_ranges_and_knows_no_row_twice():
    plan = read_plan()
    for constant in plan.constants.values():
        assert len({check_default(name) for name in constant.parameters}) == 1, 'one default'
    titles = [row.condition.title for row in plan.limits]
    assert len(titles) == len(set(titles))
    assert not {(c.node, c.key) for c in CONSTANTS if c.kind == 'published'} & {
        tuple(name.split('.'))
        for constant in plan.constants.values()
        if constant.origin == 'free'
        for name in constant.parameters
    }


def test_scoreboard_calls_fitted_what_the_shipped_plan_fits():
    assert {row.condition: row.thesis_deg for row in LIMITS if row.fitted} == {
        row.condition: row.thesis_deg for row in read_plan().fitted
    }


def check_default(name):
    node, key = name.split('.')
    default = specifications(table_of(node))[key].default
    check(table_of(node), key, default)
    return default


@pytest.mark.parametrize(
    ('change', 'word'),
    [
        (lambda d: d['constants']['com_lifted'].update(range=[0.02, 0.01]), 'range'),
        (lambda d: d['constants']['com_lifted'].update(parameters=['gait.no']), 'gait.no'),
        (lambda d: d['constants']['com_lifted'].update(range=[0.0, 9.0]), 'com_lifted'),
        (lambda d: d['constants']['com_lifted'].update(logarithmic=True, range=[0, 1e-2]), '> 0'),
        (lambda d: d['limits'][0].update(motion='fly'), 'motion'),
        (lambda d: d['limits'][0].update(speed=1.0), 'speed'),
        (lambda d: d.update(limits=[]), 'at least one'),
        (lambda d: d.update(placed=[{'com_lifted': 0.01}]), 'placed.0'),
        (lambda d: d.pop('constants'), 'constants'),
    ],
)
def test_plan_that_does_not_read_is_refused_with_its_place(tmp_path, change, word):
    document = yaml.safe_load((ROOT / 'config' / 'calibration.yaml').read_text())
    change(document)
    path = tmp_path / 'plan.yaml'
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(KhrError, match=word) as error:
        read_plan(path)
    assert str(path) in str(error.value)


@given(st.floats(0.0, 1.0), st.booleans())
def test_share_of_a_range_and_its_value_agree(share, logarithmic):
    constant = FreeConstant(('gait.lift',), (0.01, 0.03), '', logarithmic=logarithmic)
    value = constant.at(share)
    assert constant.range[0] <= value <= constant.range[1]
    assert constant.share(value) == pytest.approx(share, abs=1e-3)


@given(
    limit=st.floats(0.0, 15.0),
    aim=st.floats(5.0, 11.0),
    seed=st.integers(0, 9),
    tolerance=st.floats(0.1, 0.8),
)
def test_limit_is_found_within_its_tolerance_or_known_to_be_out_of_reach(
    limit, aim, seed, tolerance
):
    found = limit_near(lambda phi: phi < limit, aim, seed, tolerance)
    within = min(max(limit, aim - REACH), aim + REACH)
    assert abs(found - within) <= tolerance


def test_seeds_have_lattices_of_their_own():
    found = {limit_near(lambda phi: phi < 7.123, 7.0, seed, 0.4) for seed in range(5)}
    assert len(found) == 5


def invented(limits, monkeypatch):
    """Let every run be survived up to a limit by condition; count the runs."""
    runs = []

    def run(condition, phi, seed):
        runs.append((condition, phi, seed))
        verdict = 'walked' if phi < limits(condition, seed) else 'fell'
        return replace(outcome(verdict), fell_at=1.0 if verdict == 'fell' else None)

    monkeypatch.setattr(calibration_objective, 'run', run)
    return runs


TASK = Task(PLAN, PLAN.defaults, (), 2, 1e9, 0.1)


def test_robot_on_its_aims_costs_nothing_and_one_off_them_what_it_misses(monkeypatch):
    aims = {row.condition.ankle_gain: row.aim_deg for row in PLAN.fitted}
    runs = invented(lambda condition, _: aims[condition.ankle_gain], monkeypatch)
    found = measure_robot(TASK)
    assert found.complete and found.cost < 0.1 and found.runs == len(runs)
    assert {seed for _, _, seed in runs} == {0, 1}
    invented(lambda condition, _: aims[condition.ankle_gain] + 0.7, monkeypatch)
    assert measure_robot(TASK).cost == pytest.approx(2.0, abs=0.4)


def test_hopeless_robot_is_given_up_and_still_costs_more_than_a_better_one(monkeypatch):
    runs = invented(lambda *_: 0.1, monkeypatch)
    found = measure_robot(replace(TASK, hopeless=3.0))
    assert not found.complete and list(found.limits) == TITLES[:1]
    assert len(runs) < 8
    invented(lambda *_: 4.0, monkeypatch)
    better = measure_robot(replace(TASK, hopeless=3.0))
    assert not better.complete and 3.0 < better.cost < found.cost


def test_riding_down_the_board_is_no_walk(monkeypatch):
    monkeypatch.setattr(
        calibration_objective, 'run', lambda *_: outcome('slipped', slip=1.01 * RIDES)
    )
    assert measure_robot(TASK).limit(TITLES[0]) == pytest.approx(5.9 - REACH, abs=0.1)


def test_robot_that_the_physics_cannot_compute_has_fallen(monkeypatch):
    def unstable(*_):
        raise RunError('unstable')

    monkeypatch.setattr(calibration_objective, 'run', unstable)
    found = measure_robot(TASK)
    assert found.complete and found.limit(TITLES[1]) == pytest.approx(9.2 - REACH, abs=0.1)
    assert all(cost > FALL for cost in found.walks[PLAN.walks[0].title])


def test_cost_of_a_walk_grows_the_earlier_it_falls_and_the_further_it_slips_from_its_range():
    row = replace(PLAN.walks[0], slip_mm=(14.0, 56.0))
    fallen = [walk_cost(row, replace(outcome('fell'), fell_at=at)) for at in (2.0, 20.0)]
    assert fallen[0] > fallen[1] >= FALL
    slipped = [walk_cost(row, outcome(slip=mm / 1e3)) for mm in (0.0, 10.0, 14.0, 56.0, 70.0)]
    assert slipped[0] > slipped[1] > slipped[2] == slipped[3] == 0.0 < slipped[4]


@pytest.fixture
def here(monkeypatch):
    """Let the search compute in this process, in reverse order; return how often it measured."""
    measured = []

    def compute(client, function, tasks):
        for key, task in reversed(list(tasks)):
            measured.append(task)
            yield [(key, function(task))]

    monkeypatch.setattr(calibration_search, 'connected', lambda *_: nullcontext())
    monkeypatch.setattr(calibration_search, 'compute', compute)
    monkeypatch.setattr(calibration_search, 'measure_robot', measure)
    return measured


def test_search_finds_what_the_rows_want_and_keeps_every_candidate(tmp_path, here):
    robots = search(replace(SEARCH, candidates=120), tmp_path / 'journal', 1)
    assert len(robots) >= 120
    best = best_of(tmp_path / 'journal')
    assert best.cost < 0.05 < robots[0].cost
    assert best.constants['sway'] == pytest.approx(0.025, abs=0.001)


def test_candidates_placed_by_hand_are_measured_first_and_the_best_begins_the_search(
    tmp_path, here
):
    ends = [robot(sway=0.012).constants, robot(sway=0.026).constants]
    placed = replace(SEARCH, plan=replace(PLAN, placed=tuple(ends)), spread=0.01)
    robots = search(placed, tmp_path / 'journal', 1)
    assert {str(one.constants) for one in robots[:2]} == {str(one) for one in ends}
    assert all(abs(one.constants['sway'] - 0.026) < 0.005 for one in robots[2:])


def test_search_that_was_interrupted_goes_on_as_if_it_had_not_been(tmp_path, here):
    whole, cut = tmp_path / 'whole', tmp_path / 'cut'
    expected = search(SEARCH, whole, 1)
    lines = whole.read_text().splitlines(keepends=True)
    cut.write_text(''.join(lines[:9]) + lines[9][:20])
    here.clear()
    found = search(SEARCH, cut, 1)
    assert {str(one.constants) for one in found} == {str(one.constants) for one in expected}
    assert len(here) == len(expected) - 8
    here.clear()
    search(SEARCH, whole, 1)
    assert here == [], 'a finished search measures nothing again'


def test_journal_of_another_search_is_refused(tmp_path, here):
    journal = tmp_path / 'journal'
    search(SEARCH, journal, 1)
    with pytest.raises(ExperimentError, match='seeds'):
        search(replace(SEARCH, seeds=3), journal, 1)
    journal.write_text('{"no": "journal"}\n')
    with pytest.raises(ExperimentError, match='not a journal'):
        read_journal(journal)


def many(count, **figures):
    generator = np.random.default_rng(0)
    return [
        robot(0.025 + 0.0005 * generator.standard_normal(), 0.2, generator.uniform(0.01, 0.03))
        for _ in range(count)
    ]


def test_ensemble_holds_what_fits_and_tells_open_constants_from_determined_ones():
    lost = [robot(0.04), robot(walk_cost=FALL), robot(complete=False)]
    found = ensemble(PLAN, [*lost, *many(30)])
    assert found.tolerances == 1.0 and found.fitting == 30 == len(found.robots)
    assert (found.candidates, found.complete) == (33, 31)
    assert found.best.cost == min(one.cost for one in found.robots)
    said = {one.name: one for one in determined(PLAN, found)}
    assert said['lift'].is_open and not said['sway'].is_open


def test_ensemble_of_few_that_fit_states_the_tolerance_it_needs():
    wide = [robot(0.025 + 0.001 * step) for step in range(8)]
    found = ensemble(PLAN, wide, least=6)
    assert len(found.robots) == 6
    assert found.tolerances == pytest.approx(max(worst_miss(PLAN, one) for one in found.robots))
    assert found.tolerances > 1.0


def test_thinned_ensemble_keeps_the_best_and_its_width():
    robots = [robot(lift=0.01), *(robot(lift=0.02 + 0.0001 * i) for i in range(20))]
    kept = thinned(PLAN, robots, 3)
    assert kept[0] is robots[0] and kept[-1].constants['lift'] == robots[-1].constants['lift']


def test_page_data_pictures_and_constants_are_written(tmp_path):
    robots = many(25)
    out = tmp_path / 'calibration.md'
    found = write(SEARCH, robots, out)
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
        write(SEARCH, [robot(complete=False)], out)


def test_ensemble_is_written_with_what_each_robot_has_and_read_again(tmp_path):
    path = tmp_path / 'ensemble.json'
    robots = [robot(sway=0.025), robot(sway=0.0255)]
    write_ensemble(path, PLAN, ensemble(PLAN, robots))
    members = read_ensemble(path)
    assert [member.constants['gait.sway'] for member in members] == [0.025, 0.0255]
    assert spread_of(members)[TITLES[0]] == pytest.approx((5.9, 6.0))
    path.write_text('{}')
    with pytest.raises(ExperimentError, match='not an ensemble'):
        read_ensemble(path)


def test_shipped_ensemble_holds_parameters_and_its_best_is_the_default():
    members = read_ensemble()
    for member in members:
        for name, value in member.constants.items():
            node, key = name.split('.')
            check(table_of(node), key, value)
    for name, value in members[0].constants.items() if members else ():
        assert check_default(name) == value


def test_file_of_constants_tells_where_defaults_differ():
    fitted = yaml.safe_load(parameter_file(PLAN, robot(sway=0.011)))
    assert 'gait.sway' in differences(fitted)[0]


def test_defaults_are_the_fitted_constants():
    fitted = yaml.safe_load((ROOT / 'docs' / 'calibration.yaml').read_text())
    assert differences(fitted) == []


def test_every_constant_is_a_parameter_with_a_known_provenance():
    for constant in CONSTANTS:
        assert constant.key in specifications(table_of(constant.node))
        assert constant.kind in ('measured', 'published', 'derived', 'assumed')


def test_costs_of_rows_are_weighted():
    one = robot(0.027)
    heavy = replace(PLAN, limits=(replace(PLAN.limits[0], weight=3.0), *PLAN.limits[1:]))
    assert row_costs(heavy, one)[TITLES[0]] == 3.0 * row_costs(PLAN, one)[TITLES[0]]


REQUEST = Request(None, 'out', 'members', 'journal', 'mujoco', 10, 10, 0, 1, None, 1, None)


@pytest.mark.parametrize(
    ('change', 'word'),
    [
        ({'candidates': 1}, '--candidates'),
        ({'population': 1}, '--population'),
        ({'seed': -1}, '--seed'),
        ({'seeds': 0}, '--seeds'),
        ({'workers': 999}, '--workers'),
        ({'engine': 'newton'}, 'newton'),
    ],
)
def test_arguments_are_refused(change, word):
    with pytest.raises(KhrError, match=word):
        replace(REQUEST, **change).search()
