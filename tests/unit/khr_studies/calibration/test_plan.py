"""The plan of a calibration, the cost of a candidate, and the defaults."""

from dataclasses import replace

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.node_registry import table_of
from khr_common import KhrError, RunError, check, specifications
from khr_studies.calibration import objective as calibration_objective
from khr_studies.calibration.objective import (
    ENDS,
    FALL,
    Candidate,
    Task,
    limit_near,
    measure_robot,
    row_costs,
    walk_cost,
)
from khr_studies.calibration.plan import FreeConstant, read_plan
from khr_studies.calibration.result import fixed_constants
from khr_studies.calibration.rows import WantedDifference
from khr_studies.measuring.critical import START
from khr_studies.measuring.ensemble_file import read_ensemble
from khr_studies.measuring.thesis_values import LIMITS
from tests import ROOT
from tests.fakes.benches import full_outcome
from tests.fakes.robots import PLAN, TITLES, robot


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


@pytest.mark.parametrize('error', [RunError('unstable'), KhrError('left leg: too short')])
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


def test_difference_of_limits_is_a_row():
    wanted = WantedDifference(TITLES[1], TITLES[0], 3.3, 0.5)
    plan = replace(PLAN, differences=(wanted,))
    assert row_costs(plan, robot())[wanted.title] == pytest.approx(0.0)
    assert row_costs(plan, robot(board=0.3))[wanted.title] == pytest.approx(1.0)
    assert wanted.title not in row_costs(plan, Candidate({}, {TITLES[0]: [5.0]}))


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


def test_every_constant_is_a_parameter_with_a_known_provenance():
    for constant in fixed_constants():
        check_default(constant.name)
        assert constant.kind in ('measured', 'published', 'derived', 'assumed')


def test_shipped_ensemble_holds_parameters_and_its_best_is_the_default():
    members = read_ensemble()
    for member in members:
        for name, value in member.constants.items():
            node, key = name.split('.')
            check(table_of(node), key, value)
    for name, value in members[0].constants.items() if members else ():
        assert check_default(name) == value
