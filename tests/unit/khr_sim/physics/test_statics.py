"""The torques of rest follow from the potential energy, and the simulation settles at them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from khr_common import build
from khr_description.robot import JOINTS, Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.statics import GRAVITY, footing, holding_torques
from tests.fakes.postures import STANCE, crouch
from tests.support.mechanics import World

ROBOT = Robot.load()
DOWN = np.array((0.0, 0.0, -1.0))
KNEE, ANKLE = JOINTS.index('l_knee'), JOINTS.index('l_ankle_pitch')


def potential(posture, down):
    return -ROBOT.mass * GRAVITY * down @ ROBOT.center_of_mass(ROBOT.poses(posture))


@settings(max_examples=15)
@given(st.lists(st.floats(-1.0, 1.0), min_size=7, max_size=7), st.floats(-0.4, 0.4))
def test_arms_and_head_are_held_against_the_slope_of_the_potential(arms, lean):
    posture = np.array([*arms, *STANCE[7:]])
    down = np.array((np.sin(lean), 0.0, -np.cos(lean)))
    torques = holding_torques(ROBOT, ROBOT.poses(posture), down)
    for joint in range(7):
        step = np.zeros(17)
        step[joint] = 1e-5
        slope = (potential(posture + step, down) - potential(posture - step, down)) / 2e-5
        assert torques[joint] == pytest.approx(slope, abs=1e-8)


@pytest.mark.parametrize('bend_deg', [0, 25])
def test_a_bend_of_the_knees_takes_the_work_that_lowers_the_body(bend_deg):
    """Virtual work of thigh, knee and ankle together, against the fall of the body."""

    def height(bend):
        poses = ROBOT.poses(crouch(-bend, 2 * bend, -bend))
        return ROBOT.center_of_mass(poses)[2] - poses['l_sole'][2, 3]

    poses = ROBOT.poses(crouch(-bend_deg, 2 * bend_deg, -bend_deg))
    torques = holding_torques(ROBOT, poses, DOWN)
    slope = (height(bend_deg + 0.01) - height(bend_deg - 0.01)) / np.radians(0.02)
    work = 2.0 * (-torques[KNEE - 1] + 2.0 * torques[KNEE] - torques[ANKLE])
    assert work == pytest.approx(ROBOT.mass * GRAVITY * slope, abs=1e-6)


def test_one_sole_carries_all_if_the_other_is_lifted():
    posture = dict(zip(JOINTS, STANCE, strict=True)) | {
        'r_hip_pitch': -0.6,
        'r_knee': 1.2,
        'r_ankle_pitch': -0.6,
    }
    poses = ROBOT.poses(list(posture.values()))
    axes, point = footing(poses)
    assert (point == poses['l_sole'][:3, 3]).all()
    assert axes == pytest.approx(poses['l_sole'][:3, :3], abs=1e-12)
    torques = dict(zip(JOINTS, holding_torques(ROBOT, poses, DOWN), strict=True))
    hanging = ROBOT.mass * GRAVITY * 0.03
    assert abs(torques['l_ankle_roll']) > hanging / 2 > abs(torques['r_ankle_roll']) * 4


@pytest.mark.parametrize(('side', 'lean'), [('l', 0.4), ('r', -0.4)])
def test_the_foot_beyond_which_the_weight_is_carries_all(side, lean):
    down = np.array((0.0, np.sin(lean), -np.cos(lean)))
    left, right = np.abs(holding_torques(ROBOT, ROBOT.poses(STANCE), down))[[KNEE, KNEE + 5]]
    assert (left > 5.0 * right) if side == 'l' else (right > 5.0 * left)


@pytest.mark.parametrize(
    'values', [{}, {'servo_model': 'pid'}, {'inclination_deg': 5.0, 'surface': 'rubber'}]
)
def test_the_simulation_settles_where_it_starts(values):
    world = World(build(SimulatorParameters, {'servo_friction': 0.0} | values))
    start = world.reset(STANCE)
    efforts = [world.advance(STANCE) for _ in range(200)][100:]
    mean = np.mean([truth.joint_effort for truth in efforts], axis=0)
    position = np.mean([truth.joint_position for truth in efforts], axis=0)
    down = -np.mean([upward(truth) for truth in efforts], axis=0)
    world.close()
    expected = holding_torques(ROBOT, ROBOT.poses(position), down / np.linalg.norm(down))
    pitch = [index for index, name in enumerate(JOINTS) if 'roll' not in name]
    assert mean[pitch] == pytest.approx(expected[pitch], abs=0.02)
    assert position == pytest.approx(start.joint_position, abs=0.012)


def upward(truth):
    """Return the upward direction in base_link."""
    x, y, z, w = truth.orientation
    return np.array((2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)))
