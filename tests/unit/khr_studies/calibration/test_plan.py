"""The plan of a calibration, the cost of a candidate, and the defaults."""

from dataclasses import replace

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.node_registry import table_of
from khr_common import KhrError, RunError, check, specifications
from khr_studies.calibration import trial_robot
from khr_studies.calibration.objective import Task, measure_robot
from khr_studies.calibration.plan import read_plan
from khr_studies.calibration.rows import (
    LOST,
    WantedLimit,
    WantedLine,
    WantedMargin,
    WantedRatio,
    WantedSupport,
    WantedWalk,
)
from khr_studies.calibration.study import fixed_constants
from khr_studies.calibration.trial_robot import ENDS, MeasuredWalk, TrialRobot, limit_near
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.critical import START
from khr_studies.measuring.ensemble_file import read_ensemble
from khr_studies.measuring.thesis_values import LIMITS
from tests import ROOT
from tests.fakes.benches import full_outcome
from tests.fakes.robots import PLAN, TITLES


def test_shipped_plan_moves_parameters_within_their_ranges():
    plan = read_plan()
    for constant in plan.constants.values():
        assert len({check_default(name) for name in constant.parameters}) == 1, 'one default'
    fixed = fixed_constants().items()
    assert not {name for name, each in fixed if each['kind'] == 'published'} & {
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
        (
            lambda d: d.update(robots=['leaning']),
            "'leaning': simulator\\.|'leaning': ankle_controller\\.|'leaning': gait\\.",
        ),
        (lambda d: d.update(robots=['soft']), "robots: 'soft' is not accepted"),
        (lambda d: d['constants']['com_lifted'].update(parameters=['gait.no']), 'gait.no'),
        (lambda d: d['constants']['com_lifted'].update(logarithmic=True, range=[0, 1e-2]), '> 0'),
        (lambda d: d['limits'][0].update(motion='fly'), 'motion'),
        (lambda d: d.update(limits=[]), 'at least one'),
        (lambda d: d.update(added=[{'com_lifted': 0.01}]), 'added.0'),
        (lambda d: d['limits'].append(dict(d['limits'][0])), 'there twice'),
        (lambda d: d['ratios'][0].update(quantity='slip'), 'ratios.0.quantity'),
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
        first = replace(PLAN.limits[0], thesis_deg=thesis_deg)
        runs = invented(lambda *_: 6.0, monkeypatch)
        measure_robot(replace(TASK, plan=replace(PLAN, limits=(first,), walks=())))
        tried.append([phi for _, phi, _ in runs])
    assert tried[0][0] == pytest.approx(START, abs=0.05)
    assert tried[0] == tried[1]


def test_seeds_have_lattices_of_their_own():
    found = {limit_near(lambda phi: phi < 7.123, 7.0, seed, 0.4) for seed in range(5)}
    assert len(found) == 5


def invented(limits, monkeypatch):
    """Let every run be survived up to a limit by condition; count the runs."""
    runs = []

    def run(condition, phi, seed, watch=None):
        runs.append((condition, phi, seed))
        verdict = 'walked' if phi < limits(condition, seed) else 'fell'
        return full_outcome(verdict)._replace(fell_at=1.0 if verdict == 'fell' else None)

    def walk(condition, phi, seed):
        return MeasuredWalk(1.0 if run(condition, phi, seed).stayed_up else 0.1)

    monkeypatch.setattr(trial_robot, 'run_condition', run)
    monkeypatch.setattr(trial_robot, '_measure_walk', walk)
    return runs


DEFAULTS = {name: check_default(each.parameters[0]) for name, each in PLAN.constants.items()}
TASK = Task(PLAN, DEFAULTS, ('mujoco',), (0, 1), 1e9, 0.1)


def test_robot_on_its_aims_costs_nothing_and_one_off_them_what_it_misses(monkeypatch):
    aims = {row.ka: row.thesis_deg for row in PLAN.limits}
    runs = invented(lambda condition, _: aims[condition.ankle_gain], monkeypatch)
    found = measure_robot(TASK)
    assert found.complete and found.cost < 0.1 and found.runs == len(runs)
    assert {seed for _, _, seed in runs} == {0, 1}
    invented(lambda condition, _: aims[condition.ankle_gain] + 0.7, monkeypatch)
    assert measure_robot(TASK).cost == pytest.approx(2.0, abs=0.6)


def test_bad_robot_is_pruned_and_still_costs_more_than_a_better_one(monkeypatch):
    runs = invented(lambda *_: -1.0, monkeypatch)
    found = measure_robot(replace(TASK, prune_above=3.0))
    assert not found.complete and len(runs) == 1, 'it cannot walk'
    invented(lambda *_: 4.0, monkeypatch)
    better = measure_robot(replace(TASK, prune_above=3.0))
    assert not better.complete and 3.0 < better.cost < found.cost


def test_the_second_engine_follows_if_the_first_has_hope_and_the_worse_counts(monkeypatch):
    engines = []

    def measured(quick, other, prune_above=1e9):
        def limit(condition, _):
            engines.append(dict(condition.changes)['simulator', 'engine'])
            return (quick if engines[-1] == 'mujoco' else other)[condition.ankle_gain > 0.0]

        engines.clear()
        invented(limit, monkeypatch)
        return measure_robot(replace(TASK, engines=('mujoco', 'bullet'), prune_above=prune_above))

    aims, bad = [row.thesis_deg for row in PLAN.limits], [1.0, 1.0]
    assert not measured(bad, aims, 1.0).complete and set(engines) == {'mujoco'}
    found = measured(aims, bad)
    assert set(engines) == {'mujoco', 'bullet'} and found.complete
    assert found.value(TITLES[0], 'mujoco') > 2.0 > found.value(TITLES[0], 'bullet')
    same = pytest.approx(found.cost, abs=1.0)
    assert measured(bad, aims).cost == same != measured(aims, aims).cost
    assert engines.count('bullet') < engines.count('mujoco'), "it begins at the first one's limits"


@pytest.mark.parametrize('error', [RunError('unstable'), KhrError('left leg: too short')])
def test_robot_that_cannot_be_computed_has_fallen(monkeypatch, error):
    def unstable(*_):
        raise error

    monkeypatch.setattr(trial_robot, 'run_condition', unstable)
    monkeypatch.setattr(trial_robot, '_measure_walk', unstable)
    found = measure_robot(TASK)
    assert found.complete and found.value(TITLES[1]) == ENDS[0]
    assert found.value(PLAN.walks[0].title) == 0.0


FLAT, STEEP = WantedWalk(0.0), WantedWalk(5.0, ka=12.0)


@pytest.mark.parametrize(
    ('row', 'met', 'missed'),
    [
        (WantedMargin('ankle', 'gain', (18.0, 24.0), 2.0), [18.0, 24.0], [12.0, 14.0]),
        (WantedMargin('hip', 'frequency', (7.6, 9.2), 0.5), [8.0], [LOST]),
        (WantedLimit('walk', 5.55, tolerance_deg=0.7), [5.6, 5.5], [6.6, 4.5]),
        (WantedWalk(0.0), [1.0, 1.0], [1.0, 0.9]),
        (WantedRatio('vibration', STEEP, FLAT, 1.05, 1.2), [1.05, 1.4], [0.8, 0.8]),
        (WantedRatio('rate', STEEP, FLAT), [2.0], [LOST]),
        (WantedLine(FLAT, 4), [1.0], [0.7]),
        (WantedSupport(), [0.0, 0.05], [0.5]),
    ],
)
def test_row_misses_nothing_within_its_range_and_more_than_a_tolerance_far_from_it(
    row, met, missed
):
    assert row.miss(met) < 0.2 and row.miss(missed) > 1.0


def test_earlier_fall_is_a_larger_miss_and_every_fall_larger_than_a_tolerance():
    early, late = FLAT.miss([0.1]), FLAT.miss([0.99])
    assert early > late > 1.0


@pytest.mark.slow
def test_rows_measure_the_default_robot_on_the_quick_engine():
    """One robot, real runs: fast ones only. Equal runs are computed once."""
    robot = TrialRobot(((('simulator', 'engine'), 'mujoco'),), 0.8)
    walk = robot.walk(STEEP.condition, 5.0, 0)
    assert walk.lasted == 1.0 and 0.0 < walk.vibration < 0.5 and walk.lines[0] < 1e-9
    assert walk.rate**2 == pytest.approx((walk.lines**2).sum() / 2.0, rel=0.05), 'Parseval'
    assert WantedRatio('rate', FLAT, STEEP).measure(robot, 0) > 0.0
    assert robot.runs == 2
    assert WantedSupport().measure(robot, 0) <= 0.5
    assert robot.walk(Condition('walk'), 13.0, 0).lasted < 1.0


def test_the_defaults_are_the_fitted_constants():
    fitted = yaml.safe_load((ROOT / 'docs' / 'calibration.yaml').read_text())
    for node, body in fitted.items():
        for key, value in body['ros__parameters'].items():
            assert check_default(f'{node}.{key}') == value


def test_the_scoreboard_calls_fitted_what_the_plan_has():
    plan = read_plan()
    assert {row.condition: row.thesis_deg for row in LIMITS if row.fitted} == {
        row.condition: row.thesis_deg for row in plan.limits
    }


def test_every_constant_is_a_parameter_with_a_known_provenance():
    for name, constant in fixed_constants().items():
        check_default(name)
        assert constant['kind'] in ('measured', 'published', 'derived', 'assumed')
        assert constant['source'] and constant.keys() == {'kind', 'source'}


def test_shipped_ensemble_holds_parameters_and_its_best_is_the_default():
    members = read_ensemble()
    for number, member in enumerate(members):
        assert all(_differences(member, other) > 1 for other in members[:number])
        for name, value in member.constants.items():
            node, key = name.split('.')
            check(table_of(node), key, value)
    for name, value in members[0].constants.items() if members else ():
        assert check_default(name) == value


def _differences(member, other):
    return sum(value != other.constants[name] for name, value in member.constants.items())
