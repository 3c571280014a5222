"""The third stage: the climb, the plane, the linear robot, and the page on invented planes."""

from functools import partial

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
from khr_studies.third_stage.page import page, summary, write
from khr_studies.third_stage.study import HIP_GAIN, STEP, Plane, Setting, climb
from tests.support.mechanics import PLAIN_SERVOS

POINT = Setting(0.002, 0.5, 0.0)


def standing_up_to(limit, monkeypatch):
    tried = []

    def lift(condition, inclination_deg, seed):
        tried.append(inclination_deg)
        verdict = 'stood' if inclination_deg <= limit else 'fell'
        return {'stayed_up': verdict != 'fell', 'overshoot_rad_s': 0.1 + inclination_deg}

    monkeypatch.setattr(stage3, 'lift', lift)
    return tried


@pytest.mark.parametrize('limit', [0.0, 3.9, 9.55])
def test_a_climb_finds_the_limit_from_below(limit, monkeypatch):
    tried = standing_up_to(limit, monkeypatch)
    found = climb(POINT, 'mujoco', 0)
    assert found['limit_deg'] == pytest.approx(limit, abs=STEP / 16.0 + 1e-9)
    assert found['lifts'] == len(tried) == len(set(tried))
    assert found['overshoot_rad_s'] == (pytest.approx(3.9) if limit >= 3.8 else None)


def test_a_climb_ends_on_the_flat_or_at_the_end(monkeypatch):
    tried = standing_up_to(-1.0, monkeypatch)
    fallen = {'limit_deg': 0.0, 'overshoot_rad_s': None, 'lifts': 1}
    assert climb(POINT, 'mujoco', 0) == fallen and tried == [0.0]
    standing_up_to(90.0, monkeypatch)
    assert climb(POINT, 'mujoco', 0)['limit_deg'] == pytest.approx(stage3.HIGHEST_DEG)


def rows(setting, *climbs, engine='mujoco'):
    """Rows of climbs, each a limit in deg and an overshoot in rad/s."""
    return [
        setting._asdict()
        | {'engine': engine, 'seed': seed, 'limit_deg': limit, 'overshoot_rad_s': rate, 'lifts': 9}
        for seed, (limit, rate) in enumerate(climbs)
    ]


def plane(climbs=None, scales=(*np.arange(0.001, 0.0081, 0.001).round(4),), times=(0.3, 0.5, 0.7)):
    """A plane of climbs, by default with an edge without the hip and a later one with it."""
    table = rows(Setting(0.0, 0.3, 0.0), (6.4, 0.1))
    for scale in scales:
        for time in times:
            for hip in (0.0, HIP_GAIN):
                setting = Setting(scale, time, hip)
                table += rows(setting, *(climbs or edged)(setting))
    return Plane(run_table([*table, *rows(Setting(0.001, 0.3, 0.0), (6.0, 0.1), engine='bullet')]))


def edged(setting, without=0.0045):
    """Limits that grow with the scale up to an edge, and are 0 beyond it."""
    edge = 0.0055 if setting.hip_gain else without
    stands = setting.force_scale < edge * setting.time_constant / 0.5
    return [(6.4 + 300.0 * setting.force_scale, 0.2) if stands else (0.0, None)] * 2


def test_the_edge_lies_between_standing_and_falling_on_the_flat():
    found = plane()
    assert found.edge(0.5, 0.0) == pytest.approx(0.0045)
    assert found.edge(0.5, HIP_GAIN) == pytest.approx(0.0055)
    for nowhere in (0.0, 1.0):
        assert plane(partial(edged, without=nowhere)).edge(0.5, 0.0) is None
    assert found.worth.shape == (3, 8)
    row = found.worth[found.times.index(0.5)]
    assert np.flatnonzero(row > stage3.WORTH).tolist() == [found.scales.index(0.005)]
    one_seed = plane(lambda setting: [(7.0, 0.2), (setting.force_scale < 0.003, 0.2)])
    assert one_seed.edge(0.5, 0.0) == pytest.approx(0.0025), 'a fall of one seed is enough'


def test_the_nearest_point_has_both_limits_of_the_thesis():
    def climbs(setting):
        met = setting[:2] == (0.004, 0.5)
        return [(9.6 if setting.hip_gain else 7.6, None)] if met else edged(setting)

    assert plane(climbs).nearest == Setting(0.004, 0.5, HIP_GAIN)


def test_the_model_predicts_its_own_edge():
    """A robot that falls where the model grows at one rate: the prediction must find that rate."""
    rate = 0.0

    def climbs(setting):
        stands = growth(setting.force_scale, setting.time_constant, setting.hip_gain) < rate
        return [(8.0 if stands else 0.0, None)]

    scales = np.arange(0.001, 0.0101, 0.0005).round(4).tolist()
    for edge in edges(plane(climbs, scales, (0.4, 0.6))).itertuples():
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
    stretched = standing_loop(scenario.changed({('simulator', 'servo_model'): 'stretch'}), 2)
    identified = standing_loop(scenario.changed({('simulator', 'servo_model'): 'pid'}), 2)
    assert identified.servos.back_emf.min() > stretched.servos.back_emf.max(), (
        'its derivative term'
    )
    assert identified.growth < stretched.growth


@pytest.mark.slow
def test_page_plots_and_data_are_written(tmp_path):
    out, found = tmp_path / 'stage3.md', plane()
    assert write(found, compare_with_model(found), out) == summary(found)
    kept = Plane.read(out.with_suffix('.csv'))
    assert (
        page(kept, compare_with_model(kept), 'stage3.png', 'stage3_swing.png') == out.read_text()
    )
    assert (tmp_path / 'stage3.png').stat().st_size > 10_000
    text = out.read_text(encoding='utf-8')
    assert "At 3 of 24 points the hip's rate raises the limit by 0.7 deg or more" in text
    assert 'the rate adds +0.00 deg on average' in text
    assert '| 0.5 | 4.50 |' in text and '7.6 (11)' in text and '0.0 (-)' in text


def test_a_seed_that_fell_before_leaves_no_overshoot():
    found = plane(lambda setting: [(8.0, 0.2), (1.0, None)])
    assert found.grid('overshoot_rad_s', 0.0).isna().all(axis=None)
    assert (found.limits(0.0) == 4.5).all()


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
