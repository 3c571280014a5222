"""The third stage: the climb, the plane, the linear robot, and the page."""

from itertools import product

import numpy as np
import pytest

from khr_bringup.offline import run_offline
from khr_description.robot import JOINTS, Robot
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.run_table import run_table
from khr_studies.third_stage import study as stage3
from khr_studies.third_stage.comparison import (
    chain_of,
    compare_with_model,
    edges,
    growth,
    standing_loop,
)
from khr_studies.third_stage.page import summary, write
from khr_studies.third_stage.study import HIP_GAIN, STEP, Plane, Setting, climb
from tests import ROOT
from tests.support.mechanics import PLAIN_SERVOS

POINT, DOCS = Setting(0.002, 0.5, 0.0), ROOT / 'docs'


def standing_up_to(limit, monkeypatch):
    tried = []

    def lift(condition, inclination_deg, seed):
        tried.append(inclination_deg)
        verdict = 'stood' if inclination_deg <= limit else 'fell'
        return {'stayed_up': verdict != 'fell', 'overshoot_rad_s': 0.1 + inclination_deg}

    monkeypatch.setattr(stage3, 'lift', lift)
    return tried


@pytest.mark.parametrize(
    ('falls_above', 'limit'),
    [(-1.0, 0.0), (0.0, 0.0), (3.9, 3.9), (9.55, 9.55), (90.0, stage3.HIGHEST_DEG)],
)
def test_a_climb_finds_the_limit_from_below(falls_above, limit, monkeypatch):
    tried = standing_up_to(falls_above, monkeypatch)
    found = climb(POINT, 'mujoco', 0)
    assert found['limit_deg'] == pytest.approx(limit, abs=STEP / 16.0 + 1e-9)
    assert found['lifts'] == len(tried) == len(set(tried)) and (len(tried) == 1) == (
        falls_above < 0.0
    )
    assert found['overshoot_rad_s'] == (pytest.approx(3.9) if limit >= 3.8 else None)


def test_the_model_predicts_its_own_edge():
    """A robot that falls where the model grows at one rate: the prediction must find that rate."""
    rate, climbs = 0.0, []
    for scale, time, hip in product(np.arange(0.001, 0.0101, 0.0005), (0.4, 0.6), (0.0, HIP_GAIN)):
        setting = Setting(round(scale, 4), time, hip)
        found = {'engine': 'mujoco', 'seed': 0, 'limit_deg': 8.0 * (growth(*setting) < rate)}
        climbs.append(setting._asdict() | found | {'overshoot_rad_s': None, 'lifts': 9})
    for edge in edges(Plane(run_table(climbs))).itertuples():
        assert edge.growth == pytest.approx(rate, abs=0.25)
        assert edge.predicted == pytest.approx(edge.with_hip, abs=0.0005)
        assert edge.with_hip > edge.without_hip


def posture():
    angles = np.zeros(len(JOINTS))
    for side in 'lr':
        for name, angle in (('hip_pitch', -0.3), ('knee', 0.6), ('ankle_pitch', -0.3)):
            angles[JOINTS.index(f'{side}_{name}')] = angle
    return angles


@pytest.mark.parametrize('sides', ['r', 'lr'])
def test_the_chain_has_the_mass_and_the_centre_of_the_robot(sides):
    robot = Robot.load()
    poses = robot.poses(posture())
    chain = chain_of(robot, posture(), sides)
    feet = {
        link
        for side in sides
        for link in robot.descendants(robot.joints[f'{side}_ankle_pitch'].child)
    }
    links = [robot.links[name] for name in robot.links if name not in feet]
    assert chain.masses.sum() == pytest.approx(sum(link.mass for link in links))
    moment = sum(
        link.mass * (poses[link.name] @ (*link.center_of_mass, 1.0))[:3] for link in links
    )
    ankle = poses[robot.joints[f'{sides[0]}_ankle_pitch'].child][:3, 3]
    sole = poses[f'{sides[0]}_sole'][:3, :3]
    centre = sole.T @ (moment / chain.masses.sum() - ankle)
    found = chain.masses @ chain.centres / chain.masses.sum()
    assert found == pytest.approx(centre[[0, 2]])
    names = [name for name in robot.links if name not in feet]
    about = sole.T @ robot.inertia(poses, ankle, names) @ sole
    assert chain.mass_matrix[0, 0] == pytest.approx(about[1, 1])


def test_two_legs_are_twice_as_stiff_and_the_scenario_sets_the_loop():
    scenario = Setting(0.004, 0.4, HIP_GAIN).condition('bullet').scenario(0.0)
    two, one = standing_loop(scenario, 2), standing_loop(scenario, 1)
    assert two.servos.stiffness == pytest.approx(2.0 * one.servos.stiffness)
    assert two.force_time == 0.4 and two.ankle_gain > 0.0 and two.hip_gain > 0.0
    without = standing_loop(Setting(0.004, 0.4, 0.0).condition('bullet').scenario(0.0), 2)
    assert without.hip_gain == 0.0 and without.growth > two.growth
    stretched, identified = (
        standing_loop(scenario.changed({('simulator', 'servo_model'): model}), 2)
        for model in ('stretch', 'pid')
    )
    assert identified.growth < stretched.growth, 'its derivative term brakes'


@pytest.mark.slow
def test_the_page_is_that_of_its_climbs_and_written_with_its_pictures(tmp_path):
    shipped, out = Plane.read(DOCS / 'stage3.csv'), tmp_path / 'stage3.md'
    assert write(shipped, compare_with_model(shipped), out) == summary(shipped)
    assert out.read_text() == (DOCS / 'stage3.md').read_text()
    assert Plane.read(out.with_suffix('.csv')).climbs.equals(shipped.climbs)
    for name in ('stage3.png', 'stage3_swing.png'):
        assert (tmp_path / name).stat().st_size > 10_000


@pytest.mark.slow
def test_the_robot_swings_at_the_frequency_of_the_model():
    """Standing on two feet without dry friction, from a small error of its posture."""
    servos = {('simulator', key): value for key, value in PLAIN_SERVOS.items()}
    still = servos | {
        ('gait', 'motion'): 'stand',
        ('simulator', 'level_start'): False,
        ('simulator', 'servo_friction'): 0.0,
        ('simulator', 'duration'): 6.0,
    }
    scenario = Setting(0.001, 0.5, 0.0).condition('mujoco').scenario(0.0, 0).changed(still)
    rates = []
    run_offline(scenario, lambda truth, *_: rates.append(truth.mean_angular_velocity[1]))
    period = scenario.table(RunParameters).control_period
    heard = np.array(rates[round(0.5 / period) :])
    spectrum = np.abs(np.fft.rfft(heard - heard.mean(), 8 * heard.size))
    frequency = np.argmax(spectrum) / (8 * heard.size * period)
    assert standing_loop(scenario, 2).frequency == pytest.approx(frequency, rel=0.08)
