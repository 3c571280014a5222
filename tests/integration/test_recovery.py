"""The recovery node on the simulated robot."""

from __future__ import annotations

import numpy as np
import pytest

from khr_bringup.balance import BalanceModel
from khr_bringup.bout.bout import load_bout
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from khr_common.interfaces import RECOVERY_STATE
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.ensemble_file import ensemble_digest
from khr_studies.measuring.run_table import read_table
from khr_studies.push.study import START, PushCondition, falls
from khr_studies.recovery.study import Case, push_once, push_walk, quiet_run
from tests import ROOT

ENGINES = ('mujoco', 'bullet')
ENABLED = (('recovery', 'enabled'), True)
# The impulses that K_A 12 holds, N s: from behind and from the front, by inclination in deg.
HELD = {('behind', 0.0): 0.84, ('front', 0.0): 0.78, ('behind', 5.0): 0.55, ('front', 5.0): 1.04}


def condition(direction, inclination, engine, *changes):
    return PushCondition(
        12.0,
        direction=direction,
        changes=(
            (('simulator', 'engine'), engine),
            (('simulator', 'inclination_deg'), inclination),
            (('simulator', 'stop_when_tilted_deg'), 88.0),
            *changes,
        ),
    )


def errors(scenario):
    """Return the errors of the estimate in the 0.3 s from a push, centre and capture point, m."""
    model, robot = None, Robot.load()
    before, middle, found = None, 0.0, []

    def watch(truth, loop, _):
        nonlocal model, before, middle
        model = model or BalanceModel(robot, scenario.table(RunParameters))
        pose = [*truth.position.tolist(), *truth.orientation.tolist()]
        normal = truth.contact_force[:, 2].tolist()
        joints = truth.joint_position.tolist()
        before = model.at(pose, joints, truth.inclination, normal, before, 0.015)
        ahead = np.array([np.cos(truth.inclination), 0.0, -np.sin(truth.inclination)])
        time = truth.stamp_ns / 1e9 - START
        if time <= 0.0:
            middle = float(truth.sole_position.mean(axis=0) @ ahead)
        elif time < 0.3:
            _, com, capture, _ = loop.signals[RECOVERY_STATE]
            found.append(
                (
                    com + middle - float(before.below @ ahead),
                    capture + middle - float(before.capture @ ahead),
                )
            )

    run_offline(scenario, watch)
    return np.array(found)


@pytest.mark.nightly
@pytest.mark.parametrize('engine', ENGINES)
def test_the_estimate_is_within_5_mm_and_12_mm_of_the_truth_over_16_pushes(engine):
    found = []
    for (direction, inclination), held in HELD.items():
        # It waits, however far the robot tips.
        waits = [(('recovery', name), [0.2, 0.2]) for name in ('threshold', 'tipping_threshold')]
        own = condition(direction, inclination, engine, ENABLED, *waits)
        for part in (0.5, 0.8, 0.97, 1.15):
            pushed = own.scenario(part * held / own.duration)
            found.append(errors(pushed.changed({('simulator', 'duration'): START + 0.35})))
    com, capture_point = np.sqrt(np.mean(np.concatenate(found) ** 2, axis=0))
    assert com < 5e-3
    assert capture_point < 12e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ('direction', 'inclination', 'times', 'engine'),
    [
        ('behind', 0.0, 1.5, 'mujoco'),
        ('behind', 5.0, 1.5, 'mujoco'),
        ('front', 0.0, 1.2, 'bullet'),
    ],
)
def test_a_step_holds_a_push_that_topples_the_ankle_control(direction, inclination, times, engine):
    force = times * HELD[direction, inclination] / 0.1
    assert falls(condition(direction, inclination, engine), force)
    assert not falls(condition(direction, inclination, engine, ENABLED), force)


@pytest.mark.slow
@pytest.mark.parametrize('name', ['push_behind_step', 'push_front_step'])
def test_the_robot_with_its_sensors_steps_and_closes_its_stance(name):
    pushed = load_scenario(name).set_to(['simulator.engine=mujoco'])
    assert not run_offline(pushed).outcome.fell
    planted = pushed.set_to(['recovery.enabled=false'])
    assert run_offline(planted).outcome.fell


@pytest.mark.slow
@pytest.mark.parametrize('engine', ENGINES)
def test_the_robot_that_has_stepped_closes_its_stance_on_its_soles(engine):
    case = Case('behind', duration=0.5)
    stepped = push_once(case.condition(engine, recovery=True), 1.71)
    assert not stepped['fell'], 'it tips over its outer edge if it closes with 3 mm inboard'
    assert stepped['steps'] == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    ('direction', 'phase', 'impulse'), [('behind', 0.25, 0.76), ('front', 0.0625, 0.62)]
)
def test_a_step_out_of_a_walk_holds_a_push_that_topples_it(direction, phase, impulse):
    case = Case(direction)
    assert push_walk(case.condition('mujoco', motion='walk'), impulse, phase)['fell']
    stepped = push_walk(case.condition('mujoco', recovery=True, motion='walk'), impulse, phase)
    assert not stepped['fell']
    assert stepped['steps'] == 1


def test_a_weak_push_topples_no_walk_that_holds_it_without_the_node():
    case = Case('behind')
    for phase in (0.205, 0.21875):
        walked = push_walk(case.condition('mujoco', recovery=True, motion='walk'), 0.26, phase)
        assert not walked['fell']


def test_a_robot_that_shoves_alone_does_not_step():
    shoves = (
        load_bout('shove')
        .robots['red']
        .changed({('simulator', 'duration'): 8.0, ('simulator', 'engine'): 'mujoco'})
    )
    alone = quiet_run(shoves)
    assert not alone['fell'] and alone['steps'] == 0


def test_the_members_of_the_page_are_those_of_the_ensemble():
    table = read_table(ROOT / 'docs' / 'recovery.csv')
    assert set(table['ensemble'].dropna()) == {ensemble_digest()}


def test_a_run_without_a_fall_is_the_same_bit_for_bit_with_the_node():
    scenario = load_scenario('walk_8.88deg_ka12').set_to(
        ['simulator.duration=3.0', 'simulator.engine=mujoco']
    )
    enabled = scenario.changed(dict([ENABLED]))
    assert 'recovery' in enabled.nodes
    assert run_offline(enabled).trajectory_hash == run_offline(scenario).trajectory_hash
