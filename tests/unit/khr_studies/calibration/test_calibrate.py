"""The calibration: its plan, its objective, its search, its ensemble, and the defaults."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from khr.cli.app import app
from khr_balance.errors import BalanceError
from khr_bringup.node_registry import table_of
from khr_common import KhrError, RunError, check, specifications
from khr_studies.calibration import objective as calibration_objective
from khr_studies.calibration import search as calibration_search
from khr_studies.calibration.ensemble import (
    constant_spreads,
    ensemble,
    ensemble_members,
    missed_rows,
    worst_miss,
)
from khr_studies.calibration.journal import Journal, physics_digest
from khr_studies.calibration.objective import (
    ENDS,
    FALL,
    Candidate,
    Task,
    combine,
    cost_of,
    limit_near,
    measure_robot,
    row_costs,
    walk_cost,
)
from khr_studies.calibration.page import page, write
from khr_studies.calibration.plan import FreeConstant, read_plan
from khr_studies.calibration.result import Calibration, fixed_constants
from khr_studies.calibration.rows import WantedDifference
from khr_studies.calibration.search import KindSearch, Measurement, Search, run_search
from khr_studies.calibration.study import best_of_kinds, calibration_of, confirm, constant_lean
from khr_studies.errors import StudyError
from khr_studies.measuring.critical import START
from khr_studies.measuring.ensemble_file import read_ensemble, spread_of
from khr_studies.measuring.json_file import read_json, write_json
from khr_studies.measuring.thesis_values import FITTED, LIMITS, TRENDS
from tests import ROOT
from tests.fakes.benches import full_outcome
from tests.fakes.robots import PLAN, TITLES, measure, robot

SEARCH = Search(PLAN, 'mujoco', 0, 1, 6, 30)


def test_shipped_plan_moves_parameters_within_their_ranges_and_knows_no_row_twice():
    plan = read_plan()
    for constant in plan.constants.values():
        assert len({check_default(name) for name in constant.parameters}) == 1, 'one default'
    titles = [row.condition.title for row in plan.limits]
    assert len(titles) == len(set(titles))
    assert not {fixed.name for fixed in fixed_constants() if fixed.kind == 'published'} & {
        name
        for constant in plan.constants.values()
        if constant.origin == 'free'
        for name in constant.parameters
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
        (lambda d: d['constants']['com_lifted'].update(logarithmic=True, range=[0, 1e-2]), '> 0'),
        (lambda d: d['limits'][0].update(motion='fly'), 'motion'),
        (lambda d: d.update(limits=[]), 'at least one'),
        (lambda d: d.update(placed=[{'com_lifted': 0.01}]), 'placed.0'),
        (lambda d: d['differences'][0].update(above='walk, K_A 99'), 'differences.0.*K_A 99'),
        (lambda d: d['settings'].update({'gait.stride': 9.0}), 'settings: gait.stride'),
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
    near=st.floats(0.0, 14.0),
    seed=st.integers(0, 9),
    tolerance=st.floats(0.1, 0.8),
)
def test_limit_is_found_within_its_tolerance_wherever_its_search_begins(
    limit, near, seed, tolerance
):
    found = limit_near(lambda phi: phi < limit, near, seed, tolerance)
    assert abs(found - min(max(limit, ENDS[0]), ENDS[1])) <= tolerance


def test_search_of_a_limit_begins_at_no_number_of_the_thesis(monkeypatch):
    tried = []
    for thesis_deg in (2.0, 9.0):
        first = replace(PLAN.limits[0], thesis_deg=thesis_deg, aim_deg=None)
        plan = replace(PLAN, limits=(first, *PLAN.limits[1:]))
        runs = invented(lambda *_: 6.0, monkeypatch)
        measure_robot(replace(TASK, plan=plan))
        tried.append([phi for _, phi, _ in runs])
    assert tried[0][1] == pytest.approx(START, abs=0.05), 'after the walk on level ground'
    assert tried[0] == tried[1]


def test_seeds_have_lattices_of_their_own():
    found = {limit_near(lambda phi: phi < 7.123, 7.0, seed, 0.4) for seed in range(5)}
    assert len(found) == 5


def invented(limits, monkeypatch):
    """Let every run be survived up to a limit by condition; count the runs."""
    runs = []

    def run(condition, phi, seed):
        runs.append((condition, phi, seed))
        verdict = 'walked' if phi < limits(condition, seed) else 'fell'
        return full_outcome(verdict)._replace(fell_at=1.0 if verdict == 'fell' else None)

    monkeypatch.setattr(calibration_objective, 'run_condition', run)
    return runs


DEFAULTS = {name: check_default(each.parameters[0]) for name, each in PLAN.constants.items()}
TASK = Task(PLAN, DEFAULTS, ('mujoco',), 2, 1e9, 0.1)


def test_robot_on_its_aims_costs_nothing_and_one_off_them_what_it_misses(monkeypatch):
    aims = {row.condition.ankle_gain: row.aim for row in PLAN.fitted}
    runs = invented(lambda condition, _: aims[condition.ankle_gain], monkeypatch)
    found = measure_robot(TASK)
    assert found.complete and found.cost < 0.1 and found.runs == len(runs)
    assert {seed for _, _, seed in runs} == {0, 1}
    invented(lambda condition, _: aims[condition.ankle_gain] + 0.7, monkeypatch)
    assert measure_robot(TASK).cost == pytest.approx(2.0, abs=0.6)


def test_bad_robot_is_pruned_and_still_costs_more_than_a_better_one(monkeypatch):
    runs = invented(lambda *_: -1.0, monkeypatch)
    found = measure_robot(replace(TASK, prune_above=3.0))
    assert not found.complete and not found.limits and len(runs) == 1, 'it cannot walk'
    invented(lambda *_: 4.0, monkeypatch)
    better = measure_robot(replace(TASK, prune_above=3.0))
    assert not better.complete and 3.0 < better.cost < found.cost


def test_robot_is_measured_on_the_second_engine_if_the_first_has_hope_and_costs_the_worse(
    monkeypatch,
):
    def measured(prune_above, quick, other):
        engines = []

        def run(condition, phi, _):
            changes = dict(condition.changes)
            engine = changes['simulator', 'engine']
            engines.append(engine)
            limit = (quick if engine == 'mujoco' else other)[condition.ankle_gain > 0.0]
            verdict = 'walked' if phi < limit else 'fell'
            return full_outcome(verdict)._replace(fell_at=1.0 if verdict == 'fell' else None)

        monkeypatch.setattr(calibration_objective, 'run_condition', run)
        both = replace(TASK, engines=('mujoco', 'bullet'), prune_above=prune_above)
        return measure_robot(both), engines

    aims, bad = [row.aim for row in PLAN.fitted], [1.0, 1.0]
    pruned, on = measured(1.0, bad, aims)
    assert set(on) == {'mujoco'} and not pruned.complete
    found, on = measured(1e9, aims, bad)
    assert set(on) == {'mujoco', 'bullet'} and found.complete
    same = pytest.approx(found.cost, abs=1.0)
    assert measured(1e9, bad, aims)[0].cost == same != measured(1e9, aims, aims)[0].cost
    assert found.engines['mujoco'][TITLES[0]] > 2.0 > found.engines['bullet'][TITLES[0]]
    _, on = measured(1e9, aims, aims)
    assert on.count('bullet') < on.count('mujoco'), 'its searches begin at the limits of the first'


@pytest.mark.parametrize('error', [RunError('unstable'), BalanceError('left leg: too short')])
def test_robot_that_cannot_be_computed_has_fallen(monkeypatch, error):
    def unstable(*_):
        raise error

    monkeypatch.setattr(calibration_objective, 'run_condition', unstable)
    found = measure_robot(TASK)
    assert found.complete and found.limit(TITLES[1]) == ENDS[0]
    assert all(cost > FALL for cost in found.walks[PLAN.walks[0].title])


def test_cost_of_a_walk_grows_the_earlier_it_falls_and_the_further_it_slips_from_its_range():
    row = replace(PLAN.walks[0], slip_mm=(14.0, 56.0))
    fallen = [walk_cost(row, full_outcome('fell')._replace(fell_at=at)) for at in (2.0, 20.0)]
    assert fallen[0] > fallen[1] >= FALL
    slipped = [walk_cost(row, full_outcome(slip=mm / 1e3)) for mm in (0.0, 10.0, 14.0, 56.0, 57.0)]
    assert slipped[0] > slipped[1] > slipped[2] == slipped[3] == 0.0 and slipped[4] == FALL


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


OFFSETS = {
    'reference': FreeConstant(
        ('ankle_controller.reference_offset',), (-1.0, 0.0), '', offset='before', costs_one_at=0.5
    ),
    'lean': FreeConstant(
        ('ankle_controller.lean_deg',), (0.0, 5.0), '', offset='behind', costs_one_at=2.0
    ),
}
KINDS = replace(PLAN, constants={'sway': PLAN.constants['sway'], **OFFSETS})


def test_each_kind_of_offset_is_searched_by_itself_and_its_size_costs(tmp_path, here, monkeypatch):
    monkeypatch.setattr(
        calibration_search, 'measure_robot', lambda task: of_kind(**task.constants)
    )
    robots = searched(tmp_path / 'journal', replace(SEARCH, plan=KINDS, candidates=60))
    kinds = {
        kind: [one for one in robots if KINDS.kind(one.constants) == kind]
        for kind in ('none', 'before', 'behind')
    }
    assert all(len(some) >= 20 for some in kinds.values())
    for kind, names in (('none', ()), ('before', ('reference',)), ('behind', ('lean',))):
        for one in kinds[kind]:
            assert {name for name in OFFSETS if one.constants[name]} == set(names)
    leaning = replace(of_kind(), constants=of_kind(lean=2.0).constants)
    assert cost_of(KINDS, leaning) == pytest.approx(1.0 + cost_of(KINDS, of_kind()))
    chosen = best_of_kinds(KINDS, sorted(robots, key=lambda one: one.cost), 6)
    assert {KINDS.kind(one.constants) for one in chosen} == {'none', 'before', 'behind'}


def of_kind(sway=0.025, reference=0.0, lean=0.0):
    """Return a robot that an offset makes worse."""
    found = robot(sway + 0.001 * (lean - reference))
    constants = {'sway': sway, 'reference': reference, 'lean': lean}
    found = replace(found, constants=constants)
    return replace(found, cost=cost_of(KINDS, found))


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
    with pytest.raises(StudyError, match='seeds'):
        searched(journal, replace(SEARCH, seeds=3))
    monkeypatch.setattr(calibration_search, 'physics_digest', lambda *_: 'other')
    with pytest.raises(StudyError, match=r"physics: .*'invented'.*, now .*'other'"):
        searched(journal)
    journal.write_text('{"no": "journal"}\n')
    with pytest.raises(StudyError, match='not a journal'):
        searched(journal)


@pytest.mark.slow
def test_physics_digest_a_plan_changes_with_its_settings():
    slick = replace(PLAN, settings={'simulator.servo_friction': 0.1})
    assert (
        physics_digest(PLAN, 'mujoco')
        == physics_digest(PLAN, 'mujoco')
        != physics_digest(slick, 'mujoco')
    )


def test_the_best_are_confirmed_on_both_engines_and_cost_what_the_worse_one_says(tmp_path, here):
    robots = searched(tmp_path / 'journal')
    here.clear()
    with Journal(tmp_path / 'journal', SEARCH.head) as book:
        found = confirm(SEARCH, robots, 3, Measurement(book, None))
        again = confirm(SEARCH, robots, 3, Measurement(book, None))
        assert len(book.candidates('confirmed')) == 3
    assert [task.engines for task in here] == [('mujoco', 'bullet')] * 3, 'and not twice'
    assert {(task.seeds, task.prune_above) for task in here} == {(3, float('inf'))}
    assert again == found and len(found) == 3
    better, worse = robot(0.025), robot(0.027)
    both = combine({'bullet': better, 'mujoco': replace(worse, constants=better.constants)})
    assert both.cost == worse.cost > better.cost
    assert both.limit(TITLES[0]) == pytest.approx(6.1)
    assert worst_miss(PLAN, both) == worst_miss(PLAN, worse)


def test_a_candidate_is_pruned_above_the_parents_of_the_next_generation():
    kind = KindSearch(SEARCH, 'none')
    number = len(kind.ask())
    before = kind.prune_above
    pruned = [Candidate({}, cost=float(each)) for each in range(number)]
    kind.tell(pruned)
    assert kind.prune_above == before, 'their costs are estimates'
    kind.tell([replace(each, complete=True) for each in pruned])
    assert kind.prune_above == SEARCH.population // 2 - 1 < before


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
    said = {one.name: one for one in constant_spreads(PLAN, found)}
    assert said['lift'].is_open and not said['sway'].is_open


def test_ensemble_of_few_that_fit_states_the_tolerance_it_needs():
    wide = [robot(0.025 + 0.001 * step) for step in range(8)]
    found = ensemble(PLAN, wide, least=6)
    assert len(found.robots) == 6
    assert found.tolerances == pytest.approx(max(worst_miss(PLAN, one) for one in found.robots))
    assert found.tolerances > 1.0


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
    made = replace(robot(), limits={t: [x] for t, x in zip(TITLES, limits, strict=True)})
    return replace(made, cost=cost_of(PLAN, made))


def test_the_robot_that_misses_the_fewest_rows_is_chosen_even_at_a_higher_cost():
    one_far, both_near = (
        limited(5.9, 9.2 + 2.0 * PLAN.limits[1].tolerance_deg),
        limited(
            5.9 + 1.05 * PLAN.limits[0].tolerance_deg, 9.2 + 1.05 * PLAN.limits[1].tolerance_deg
        ),
    )
    assert one_far.cost > both_near.cost
    assert [len(missed_rows(PLAN, each)) for each in (one_far, both_near)] == [1, 2]
    found = calibration_of(SEARCH, [both_near, one_far])
    assert found.best == one_far
    assert 'misses 2' in page(found, 'calibration')


def test_a_row_missed_is_searched_among_all_candidates():
    """Of three robots the best misses the second row; the one that meets it misses the first."""

    robots = [limited(5.9, 12.0), limited(9.0, 9.2), limited(9.0, 12.0)]
    robots.append(replace(limited(9.0, 9.2), complete=False))
    (row,) = calibration_of(SEARCH, robots).resisting
    assert (row.row, row.meeting, row.candidates) == (TITLES[1], 1, 3)
    assert row.missed == (TITLES[0],)
    none = calibration_of(SEARCH, [limited(5.9, 12.0)])
    assert none.resisting[0].meeting == 0 and none.resisting[0].missed == ()
    assert 'Rows in conflict' not in page(calibration_of(SEARCH, [robot()]), 'calibration')


def test_difference_of_limits_is_a_row():
    wanted = WantedDifference(TITLES[1], TITLES[0], 3.3, 0.5)
    plan = replace(PLAN, differences=(wanted,))
    assert row_costs(plan, robot())[wanted.title] == pytest.approx(0.0)
    assert row_costs(plan, robot(board=0.3))[wanted.title] == pytest.approx(1.0)
    assert wanted.title not in row_costs(plan, Candidate({}, {TITLES[0]: [5.0]}))


@pytest.mark.slow
def test_lean_of_a_robot_is_the_constant_part_of_its_correction():
    lean = constant_lean(replace(PLAN, constants=OFFSETS), of_lean(3.0))
    assert lean.deg == pytest.approx(3.0, abs=0.3) and lean.share > 0.8
    assert abs(constant_lean(replace(PLAN, constants=OFFSETS), of_lean(0.0)).deg) < 1.0


def of_lean(deg):
    return Candidate({'reference': 0.0, 'lean': deg})


def test_ensemble_is_written_with_what_each_robot_has_and_read_again(tmp_path):
    path = tmp_path / 'ensemble.json'
    robots = [robot(sway=0.025), robot(sway=0.0255)]
    write_json(path, ensemble_members(PLAN, ensemble(PLAN, robots)))
    kept = read_ensemble(path)
    assert [member.constants['gait.sway'] for member in kept] == [0.025, 0.0255]
    assert spread_of(kept)[TITLES[0]] == pytest.approx((5.9, 6.0))
    path.write_text('{}')
    with pytest.raises(StudyError, match='not an ensemble'):
        read_ensemble(path)


def test_shipped_ensemble_holds_parameters_and_its_best_is_the_default():
    members = read_ensemble()
    for member in members:
        for name, value in member.constants.items():
            node, key = name.split('.')
            check(table_of(node), key, value)
    for name, value in members[0].constants.items() if members else ():
        assert check_default(name) == value


def differences(fitted):
    """List the constants of a parameter file that differ from the defaults, in words."""
    return [
        f'{node}.{key}: fitted {value}, the default is {check_default(f"{node}.{key}")}'
        for node, body in fitted.items()
        for key, value in body['ros__parameters'].items()
        if check_default(f'{node}.{key}') != value
    ]


def test_defaults_are_the_fitted_constants():
    fitted = yaml.safe_load((ROOT / 'docs' / 'calibration.yaml').read_text())
    assert differences(fitted) == []


def test_the_scoreboard_calls_fitted_what_the_plan_has():
    plan = read_plan()
    assert {row.condition: row.thesis_deg for row in LIMITS if row.fitted} == {
        row.condition: row.thesis_deg for row in plan.fitted
    }
    titles = {condition.title for condition in FITTED}
    controlled = [row for row in plan.walks if row.inclination_deg > 0.0]
    assert {row.title.rpartition(', ')[0].rpartition(', ')[0] for row in controlled} <= titles
    smooth = {row.inclination_deg for row in controlled if row.surface == 'smooth'}
    for trend in TRENDS:
        of_plan = trend.quantity == 'slide' and bool(smooth & set(trend.inclinations_deg))
        assert trend.fitted == of_plan, trend.what


def test_every_constant_is_a_parameter_with_a_known_provenance():
    for constant in fixed_constants():
        check_default(constant.name)
        assert constant.kind in ('measured', 'published', 'derived', 'assumed')


@pytest.mark.parametrize(
    ('option', 'word'),
    [
        ('--candidates=1', '--candidates'),
        ('--confirm=-1', '--confirm'),
        ('--population=1', '--population'),
        ('--seed=-1', '--seed'),
        ('--seeds=0', '--seeds'),
        ('--workers=999', '--workers'),
        ('--engine=newton', 'newton'),
    ],
)
def test_arguments_are_refused_before_anything_starts(option, word, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused = CliRunner().invoke(app, ['calibrate', option]).exception
    assert isinstance(refused, KhrError) and word in str(refused)
    assert not list(tmp_path.iterdir())
