"""The world: rest, weight, slip, tipping, momentum, determinism."""

from dataclasses import replace
from math import atan, degrees, radians

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from khr_common import ParameterError, build
from khr_common.interfaces import TRUE_POSE, TRUE_SOLES
from khr_common.rotation import matrix, pitched
from khr_description.robot import JOINTS
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.statics import GRAVITY
from khr_sim.physics.truth import GroundTruth
from tests.fakes.postures import STANCE, STRAIGHT
from tests.support.mechanics import PLAIN_SERVOS, momenta

WEIGHT = 1.5 * GRAVITY


def wave(k):
    """Return a target that moves every joint."""
    return [angle + 0.1 * np.sin(0.2 * k + j) for j, angle in enumerate(STANCE)]


def normal_error(truth):
    """Return the angle of each sole to the ground, in rad."""
    up = matrix(pitched(truth.inclination))[:, 2]
    return [np.arccos(min(matrix(sole)[:, 2] @ up, 1.0)) for sole in truth.sole_orientation]


# --- standing ------------------------------------------------------------


@pytest.mark.parametrize('model', ['stretch', 'pid'])
def test_stands_still_on_flat_ground(world_with, model):
    world = world_with(**PLAIN_SERVOS | {'servo_model': model})
    start = world.reset(STANCE)
    forces, rates = [], []
    for _ in range(134):
        truth = world.advance(STANCE)
        forces.append(truth.contact_force)
        rates.append(truth.mean_angular_velocity)
    assert np.abs(truth.position - start.position).max() < 0.001
    assert np.abs(truth.sole_position - start.sole_position).max() < 0.001
    assert max(normal_error(truth)) < radians(0.1)
    assert np.mean(forces[-67:], axis=0)[:, 2].sum() == pytest.approx(WEIGHT, rel=0.002)
    assert [f[:, 2].sum() for f in forces[-67:]] == pytest.approx([WEIGHT] * 67, rel=0.02)
    assert np.abs(rates[-67:]).max() < radians(2.0)


@pytest.mark.parametrize('inclination_deg', [-6.0, 8.0])
def test_the_ground_carries_the_weight_on_a_slope(world_with, inclination_deg):
    world = world_with(inclination_deg=inclination_deg, surface='rubber')
    world.reset(STANCE)
    forces = [world.advance(STANCE).contact_force.sum(axis=0) for _ in range(100)]
    phi = radians(inclination_deg)
    down_the_slope = (-WEIGHT * np.sin(phi), 0.0, WEIGHT * np.cos(phi))
    assert np.mean(forces[50:], axis=0) == pytest.approx(down_the_slope, abs=0.02 * WEIGHT)


@pytest.mark.parametrize('inclination_deg', [-12.0, 7.0])
@pytest.mark.parametrize('surface', ['smooth', 'pads'])
def test_starts_with_the_soles_just_touching(world_with, inclination_deg, surface):
    world = world_with(inclination_deg=inclination_deg, surface=surface)
    truth = world.reset(STANCE)
    assert max(normal_error(truth)) < radians(0.6)  # the sag of unequal legs
    up = matrix(pitched(truth.inclination))[:, 2]
    assert 0.0 <= (truth.sole_position @ up).max() < 0.0005
    assert truth.sole_position.mean(axis=0) @ (0, 1, 0) == pytest.approx(0.0, abs=1e-6)
    assert truth.contact_force == pytest.approx(np.zeros((4, 3)))


def test_stands_on_one_leg(world_with):
    posture = dict(zip(JOINTS, STANCE, strict=True))
    posture |= {name: posture[name] - 0.21 for name in ('l_hip_roll', 'r_hip_roll')}
    posture |= {name: posture[name] + 0.21 for name in ('l_ankle_roll', 'r_ankle_roll')}
    posture |= {'r_hip_pitch': radians(-34), 'r_knee': radians(68), 'r_ankle_pitch': radians(-37)}
    world = world_with()
    world.reset(list(posture.values()))
    for _ in range(66):
        truth = world.advance(list(posture.values()))
    assert truth.contact_force[:2, 2].sum() == pytest.approx(WEIGHT, rel=0.02)
    assert (truth.contact_force[2:] == 0.0).all()
    assert truth.sole_position[1, 2] > 0.01


# --- limits of standing ------------------------------------------------------------


def test_slides_at_the_angle_of_friction(world_with):
    friction = 0.18
    critical = degrees(atan(friction))
    world = world_with(
        **PLAIN_SERVOS,
        friction_smooth=friction,
        inclination_deg=critical - 1.0,
        inclination_rate_deg_s=1.0,
    )
    world.reset(STANCE)
    for _ in range(30):  # the weight comes on
        start = truth = world.advance(STANCE)
    slid = 0.0
    while slid < 0.0002:
        truth = world.advance(STANCE)
        assert degrees(truth.inclination) < critical + 1.0
        slid = np.linalg.norm(truth.sole_position - start.sole_position, axis=1).min()
    assert degrees(truth.inclination) == pytest.approx(critical, abs=0.25)
    for _ in range(60):
        truth = world.advance(STANCE)
    assert truth.sole_position[0, 0] - start.sole_position[0, 0] > 0.003


def test_on_its_pads_the_heel_lifts_where_statics_says(world_with):
    """The heel is free when the centre of mass is over the toe pad."""
    world = world_with(surface='pads', inclination_deg=4.5, inclination_rate_deg_s=0.5)
    poses = world.robot.poses(STANCE)
    center = np.linalg.inv(poses['l_sole']) @ (*world.robot.center_of_mass(poses), 1.0)
    rigid = degrees(atan((world.parameters.pad_distance - center[0]) / center[2]))
    world.reset(STANCE)
    heels = [WEIGHT] * 20
    while np.mean(heels[-20:]) > 0.01 * WEIGHT:
        truth = world.advance(STANCE)
        heels.append(truth.contact_force[[1, 3], 2].sum())
        assert truth.inclination < radians(8.0)
    # The servos give way, so the robot leans further than a rigid one and tips before it.
    assert rigid - 1.0 < degrees(truth.inclination) < rigid + 0.1


# --- mechanics ------------------------------------------------------------


def test_in_the_air_nothing_but_gravity_changes_its_momentum(world_with):
    world = world_with()
    world.reset(STANCE, clearance=2.0)
    for k in range(30):
        truth = world.advance(wave(k))
    momentum, angular, _ = momenta(world.robot, truth)
    time = truth.stamp_ns * 1e-9
    assert momentum == pytest.approx((0.0, 0.0, -WEIGHT * time), abs=0.002)
    moved = np.abs(truth.joint_velocity).max()
    assert moved > 0.5  # or the test would be empty
    assert np.abs(angular).max() < 1e-4  # kg m^2/s; one thigh alone carries more than 1e-3


# --- truth ------------------------------------------------------------


def test_truth_is_consistent_with_itself(world_with):
    world = world_with(inclination_deg=4.0)
    before = world.reset(STANCE)
    assert before.step == before.stamp_ns == 0
    assert (before.mean_angular_velocity == 0.0).all()
    period = world.parameters.control_period
    for k in range(20):
        truth = world.advance(wave(k))
        turned = Rotation.from_quat(before.orientation) * Rotation.from_rotvec(
            truth.mean_angular_velocity * period
        )
        assert turned.as_matrix() == pytest.approx(matrix(truth.orientation), abs=1e-12)
        assert truth.stamp_ns == (k + 1) * 15_000_000
        poses = world.robot.poses(truth.joint_position)
        for side, name in enumerate(('l_sole', 'r_sole')):
            sole = matrix(truth.orientation) @ poses[name][:3, 3] + truth.position
            assert truth.sole_position[side] == pytest.approx(sole, abs=1e-6)
        before = truth


@pytest.mark.parametrize('axis', [(1, 0, 0), (0.6, -0.8, 0)])
@pytest.mark.parametrize('angle', [0.0, 2.5])
def test_tilt_is_the_angle_to_the_vertical(world_with, axis, angle):
    leaning = Rotation.from_rotvec(np.multiply(axis, angle)) * Rotation.from_euler('z', 1.0)
    truth = replace(world_with().reset(STANCE), orientation=leaning.as_quat())
    assert truth.tilt == pytest.approx(angle, abs=1e-9)


def test_topics_carry_the_motion_and_give_it_back(world_with):
    world = world_with(inclination_deg=3.0)
    world.reset(STANCE)
    truth = world.advance(wave(0))
    signals = truth.signals()
    assert signals[TRUE_POSE] == [*truth.position, *truth.orientation]
    assert signals[TRUE_SOLES][7:] == [*truth.sole_position[1], *truth.sole_orientation[1]]
    again = GroundTruth.of_signals(truth.step, truth.stamp_ns, signals)
    for name in ('joint_position', 'mean_angular_velocity', 'contact_force', 'sole_orientation'):
        assert (getattr(again, name) == getattr(truth, name)).all()
    assert again.inclination == truth.inclination


# --- determinism ------------------------------------------------------------


def run(world, count=25):
    records = [world.reset(STANCE).record()]
    return records + [world.advance(wave(k)).record() for k in range(count)]


def test_reset_and_other_worlds_change_no_bit(world_with):
    first = world_with(inclination_deg=5.0)
    expected = run(first)
    assert run(first) == expected
    other = world_with(inclination_deg=-5.0, surface='pads')
    second = world_with(inclination_deg=5.0)
    records = [second.reset(STANCE).record()]
    for k in range(25):
        other.advance(wave(k)) if k % 5 else other.reset(STRAIGHT)
        records.append(second.advance(wave(k)).record())
    assert records == expected
    assert run(first) == expected


def test_the_seed_decides_the_initial_tilt(world_with):
    orientations = [
        world_with(seed=seed, initial_tilt_deg=1.0).reset(STANCE).orientation for seed in (1, 1, 2)
    ]
    assert (orientations[0] == orientations[1]).all()
    assert (orientations[0] != orientations[2]).any()
    assert (
        world_with(seed=1).reset(STANCE).orientation
        == world_with(seed=2).reset(STANCE).orientation
    ).all()


# --- parameters ------------------------------------------------------------


def test_friction_changes_during_a_run(world_with):
    world = world_with(inclination_deg=6.0)
    start = world.reset(STANCE)
    for _ in range(30):
        truth = world.advance(STANCE)
    assert np.abs(truth.sole_position - start.sole_position).max() < 0.001
    world.configure(replace(world.parameters, friction_smooth=0.02))
    for _ in range(30):
        truth = world.advance(STANCE)
    assert truth.sole_position[0, 0] - start.sole_position[0, 0] > 0.02


def test_the_ground_tilts_to_a_new_inclination(world_with):
    world = world_with(surface='rubber')
    world.reset(STANCE)
    world.configure(replace(world.parameters, inclination_deg=1.0))
    angles = [degrees(world.advance(STANCE).inclination) for _ in range(40)]
    assert np.diff(angles).max() <= 2.0 * 0.015 + 1e-9
    assert angles[-1] == pytest.approx(1.0, abs=1e-12)
    assert normal_error(world.advance(STANCE)) == pytest.approx((0.0, 0.0), abs=radians(0.2))


def test_the_ground_tilts_steadily(world_with):
    world = world_with(inclination_deg=1.0, inclination_rate_deg_s=-3.0)
    world.reset(STANCE)
    for k in range(1, 11):
        truth = world.advance(STANCE)
        assert degrees(truth.inclination) == pytest.approx(1.0 - 3.0 * 0.015 * k, abs=1e-9)


def test_what_is_fixed_for_a_run_stays(world_with):
    world = world_with()
    before = world.parameters
    fixed = {'surface': 'rubber', 'physics_step': 0.0005, 'control_period': 0.02, 'seed': 3}
    for name, value in fixed.items():
        with pytest.raises(ParameterError, match=name):
            world.configure(replace(world.parameters, **{name: value}))
        assert world.parameters == before


@pytest.mark.parametrize(
    ('values', 'says'),
    [
        ({'control_period': 0.012}, '0.015'),
        ({'physics_step': 0.0007}, '0.015'),
        ({'physics_step': 0.015 / 17}, 'nanoseconds'),
        ({'contact_time': 0.0015}, 'at least two physics steps, 0.002 s'),
    ],
)
def test_parameters_out_of_range_are_refused_in_one_line(values, says):
    with pytest.raises(ParameterError) as refusal:
        build(SimulatorParameters, values)
    assert next(iter(values)) in str(refusal.value)
    assert says in str(refusal.value)
    assert '\n' not in str(refusal.value)


@pytest.mark.parametrize('period', [0.010, 0.025])
def test_advances_one_output_period_of_the_board(world_with, period):
    world = world_with(control_period=period)
    world.reset(STANCE)
    assert world.advance(STANCE).stamp_ns == round(period * 1e9)


def test_zero_errors_displace_each_servo_once_per_seed(world_with):
    """In the air nothing loads the servos, so the joints stand where the errors put them."""

    def errors(**values):
        truth = world_with(**values).reset(STANCE, clearance=1.0)
        return np.array(truth.joint_position) - np.array(exact.joint_position)

    exact = world_with().reset(STANCE, clearance=1.0)
    seeds = [errors(zero_error_deg=0.4, seed=seed) for seed in range(6)]
    assert (errors(zero_error_deg=0.4, seed=0) == seeds[0]).all()
    assert np.degrees(np.std(seeds)) == pytest.approx(0.4, rel=0.2)
    left, right = (JOINTS.index(f'{side}_ankle_pitch') for side in 'lr')
    assert all(each[left] != each[right] for each in seeds)
    twice = errors(zero_error_deg=0.8, seed=0)
    assert twice == pytest.approx(2.0 * seeds[0], abs=1e-9)


def test_zero_errors_stay_when_the_robot_moves(world_with):
    with_errors = world_with(zero_error_deg=0.4)
    for world in (exact := world_with(), with_errors):
        world.reset(STANCE, clearance=1.0)
    for _ in range(2):
        plain, displaced = (world.advance(STANCE) for world in (exact, with_errors))
    difference = np.array(displaced.joint_position) - np.array(plain.joint_position)
    assert np.abs(np.degrees(difference)).max() > 0.2
    assert np.abs(np.degrees(displaced.joint_velocity)).max() < 5.0
