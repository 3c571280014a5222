"""Both engines obey the same mechanics, and the compiled steps are the plain ones, bit for bit."""

import sys
from functools import partial
from math import radians

import numpy as np
import pytest

from khr_common import KhrError, RunError, build
from khr_description.robot import JOINTS, Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.push import Push
from khr_sim.physics.statics import GRAVITY
from khr_sim.servo import Servos, law
from tests.fakes.postures import STANCE
from tests.support.mechanics import World, ground_forces, momenta, motions

PERIOD = 0.015
STIFF = {f'stretch_{joint}': 127 for joint in ('hip', 'knee', 'ankle_pitch', 'ankle_roll')}


def stepping(k):
    """Return a target that shifts the weight from foot to foot and lifts them a little."""
    return [
        angle + 0.12 * np.sin(0.15 * k) * name.endswith('roll') + 0.1 * np.sin(0.3 * k + len(name))
        for name, angle in zip(JOINTS, STANCE, strict=True)
    ]


# --- mechanics ------------------------------------------------------------


def test_ground_and_weight_change_the_momentum_as_newton_says(world_with):
    world = world_with(inclination_deg=3.0, surface='rubber')
    before, _, _ = momenta(world.robot, world.reset(STANCE))
    weight = np.array((0.0, 0.0, -GRAVITY * world.robot.mass))
    moved = 0.0
    for k in range(80):
        truth = world.advance(stepping(k))
        momentum, _, _ = momenta(world.robot, truth)
        force = ground_forces(truth).sum(axis=0) + weight
        # A foot that turns within the period leaves a little of the force in another direction.
        assert momentum - before == pytest.approx(force * PERIOD, abs=2e-3)
        moved = max(moved, np.abs(momentum - before).max())
        before = momentum
    assert moved > 0.05  # or the test would be empty


@pytest.mark.parametrize('direction', [0.0, 0.7])
def test_a_sliding_foot_meets_the_friction_of_a_round_cone(world_with, direction):
    """Pushed level in any direction, it slides against that direction with mu times its load."""
    friction = 0.15
    world = world_with(friction=friction)
    world.reset(STANCE)
    pull = 3.5 * np.array((np.cos(direction), np.sin(direction), 0.0))
    world.push(Push(0.3, 2.0, 'base_link', 'odom', tuple(pull), (0.0, 0.0, -0.2)))
    forces = []
    for k in range(60):
        truth = world.advance(STANCE)
        if k > 35:
            forces.append(ground_forces(truth).sum(axis=0))
    along = np.array((np.cos(direction), np.sin(direction)))
    mean = np.mean(forces, axis=0)
    assert mean[:2] @ along == pytest.approx(-friction * mean[2], rel=0.03)
    assert abs(mean[0] * along[1] - mean[1] * along[0]) < 0.05 * mean[2] * friction


def test_a_toppling_robot_is_an_inverted_pendulum(world_with):
    """It turns about its toes: what it loses in height it gains in speed."""
    world = world_with(friction=2.0, inclination_deg=14.0, **STIFF)
    start = truth = world.reset(STANCE)

    def energy(truth):
        robot, moving = world.robot, motions(world.robot, truth)
        _, _, center = momenta(robot, truth)
        kinetic = 0.0
        for link in robot.links.values():
            _, turn, linear, angular = moving[link.name]
            linear = linear + np.cross(angular, turn @ link.center_of_mass)
            inertia = turn @ link.inertia @ turn.T
            kinetic += 0.5 * (link.mass * linear @ linear + angular @ inertia @ angular)
        return kinetic, robot.mass * GRAVITY * center[2]

    _, height = energy(truth)
    while truth.tilt < radians(45.0):
        truth = world.advance(STANCE)
        assert truth.stamp_ns < 3e9
    fast, low = energy(truth)
    assert fast == pytest.approx(height - low, rel=0.06)
    assert fast > 0.3
    assert np.abs(truth.sole_position - start.sole_position).max() < 0.03


# --- the same in all ways ------------------------------------------------------------


def test_a_disturbed_period_takes_the_same_steps_as_a_whole_one(world_with):
    """A push without strength makes the world go step by step, and changes no bit."""
    whole, parts = world_with(), world_with()
    whole.reset(STANCE)
    parts.reset(STANCE)
    parts.push(Push(0.0, 10.0, 'head', 'odom', (0.0, 0.0, 0.0)))
    for k in range(40):
        expected, found = whole.advance(stepping(k)), parts.advance(stepping(k))
        assert found.record() == expected.record()
        assert (found.contact_force == expected.contact_force).all()


@pytest.mark.parametrize(
    'values',
    [
        {},
        {'backlash_deg': 0.5},
        {'servo_model': 'stretch', 'derivative_time': 0.029},
        {'servo_friction': 0.3},
    ],
    ids=['default', 'backlash', 'stretch', 'friction'],
)
def test_the_compiled_servos_are_the_plain_ones_bit_for_bit(values):
    parameters = build(SimulatorParameters, values)
    carried = Robot.load().joint_inertia()
    compiled, plain = Servos(parameters, carried), Servos(parameters, carried)
    plain._step = partial(law, plain.table, plain.constants)
    random = np.random.default_rng(1)
    for each in (compiled, plain):
        each.reset(np.array(STANCE), np.zeros(len(JOINTS)))
    for _ in range(2000):
        inputs = [random.normal(0.0, size, len(JOINTS)) for size in (0.3, 0.3, 3.0)]
        expected = compiled.update(*inputs).tobytes()
        assert plain.update(*inputs).tobytes() == expected
        assert plain.state.tobytes() == compiled.state.tobytes()


# --- what is there, and what is not ------------------------------------------------------------


def test_a_missing_library_is_one_line(monkeypatch):
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    monkeypatch.delitem(sys.modules, 'khr_sim.physics.engines.mujoco', raising=False)
    with pytest.raises(KhrError, match=r"^engine: 'mujoco' is not installed; accepted: .*$"):
        World(SimulatorParameters(engine='mujoco'))


def test_a_window_without_a_screen_is_one_line(monkeypatch, world_with):
    monkeypatch.delenv('DISPLAY', raising=False)
    with pytest.raises(KhrError, match=r'^gui: no screen .*; accepted: .*$'):
        world_with(gui=True)


def test_an_unstable_simulation_ends_the_run_in_one_line(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    world = World(SimulatorParameters(engine='mujoco'))
    world.push(Push(0.0, 0.001, 'head', 'odom', (1e200, 0.0, 0.0)))
    with pytest.raises(RunError, match=r'^mujoco: .*unstable.*$'):
        for _ in range(10):
            world.advance(STANCE)
    assert not list(tmp_path.iterdir())  # where the engine would leave a log
    World(SimulatorParameters(engine='mujoco')).advance(STANCE)  # and another run is not touched
