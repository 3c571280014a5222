"""The third stage: the climb, the plane, the linear robot, and the page on invented planes."""

from dataclasses import replace

import numpy as np
import pytest

from khr_balance.hip import HipControllerParameters
from khr_bringup.offline import run_offline
from khr_common import KhrError
from khr_sim.physics.world import Array
from khr_sim.robot import JOINTS, Robot
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.json_file import read_json
from khr_studies.third_stage import study as stage3
from khr_studies.third_stage.comparison import compare_with_model, edges, growth
from khr_studies.third_stage.page import page, summary, write
from khr_studies.third_stage.standing_model import chain_of, standing_loop
from khr_studies.third_stage.study import (
    HIP_GAIN,
    STEP,
    Climb,
    Plane,
    Point,
    Setting,
    climb,
    measure_plane,
)
from khr_sweeps.results.store import read_store
from tests.support.mechanics import PLAIN_SERVOS

POINT = Setting(0.002, 0.5, 0.0)
HIPS = ((0.0,), (HIP_GAIN, False), (HIP_GAIN, True))


def standing_up_to(limit, monkeypatch):
    tried = []

    def lift(condition, inclination_deg, seed):
        tried.append(inclination_deg)
        verdict = 'stood' if inclination_deg <= limit else 'fell'
        return {'stayed_up': verdict != 'fell', 'overshoot_rad_s': 0.1 + inclination_deg}

    monkeypatch.setattr(stage3, 'lift', lift)
    return tried


@pytest.mark.parametrize('limit', [0.0, 1.0, 3.9, 7.6, 9.55, 13.2])
def test_a_climb_finds_the_limit_from_below(limit, monkeypatch):
    tried = standing_up_to(limit, monkeypatch)
    found = climb(POINT, 'mujoco', 0)
    assert found.limit_deg == pytest.approx(limit, abs=STEP / 16.0 + 1e-9)
    assert found.runs == len(tried) == len(set(tried))
    assert found.overshoot == (pytest.approx(3.9) if limit >= 3.8 else None)


def test_a_robot_that_falls_on_the_flat_has_no_limit(monkeypatch):
    tried = standing_up_to(-1.0, monkeypatch)
    assert climb(POINT, 'mujoco', 0) == Climb(0.0, None, 1) and tried == [0.0]


def test_a_climb_ends_at_the_end(monkeypatch):
    standing_up_to(90.0, monkeypatch)
    assert climb(POINT, 'mujoco', 0).limit_deg == pytest.approx(stage3.HIGHEST_DEG)


def plane(edge_without=0.0045, edge_with=0.0055):
    """Limits that grow with the scale up to an edge, and are 0 beyond it."""

    def point(setting):
        edge = edge_with if setting.hip_gain else edge_without
        stands = setting.force_scale < edge * setting.time_constant / 0.5
        lean = 0.5 if setting.hip_gain and setting.offset else 0.0
        limit = 6.4 + 300.0 * setting.force_scale + lean if stands else 0.0
        return Point(setting, (Climb(limit, 0.2 if stands else None, 9),) * 2)

    scales, times = np.arange(0.001, 0.0081, 0.001).round(4).tolist(), [0.3, 0.5, 0.7]
    points = [point(Setting(s, t, *h)) for s in scales for t in times for h in HIPS]
    without = Point(Setting(0.0, 0.3, 0.0), (Climb(6.4, 0.1, 8),))
    check = replace(points[0], climbs=(Climb(6.0, 0.1, 5),))
    return Plane('mujoco', tuple(points), without, (check,))


def test_the_edge_lies_between_what_holds_and_what_does_not():
    found = plane()
    assert found.edge(0.5, 0.0) == pytest.approx(0.0045)
    assert found.edge(0.5, HIP_GAIN) == pytest.approx(0.0055)
    assert plane(edge_without=1.0).edge(0.5, 0.0) is None
    assert plane(edge_without=0.0).edge(0.5, 0.0) is None
    assert found.worth.shape == (3, 8)
    row = found.worth[found.times.index(0.5)]
    assert np.flatnonzero(row > stage3.WORTH).tolist() == [found.scales.index(0.005)]


def test_the_nearest_point_has_both_limits_of_the_thesis():
    aim = Setting(0.004, 0.5, HIP_GAIN)
    points = [
        replace(point, climbs=(Climb(9.6 if point.setting.hip_gain else 7.6, None, 1),))
        if (point.setting.force_scale, point.setting.time_constant) == (0.004, 0.5)
        else point
        for point in plane().points
    ]
    assert replace(plane(), points=tuple(points)).nearest == aim


def test_the_model_predicts_its_own_edge():
    """A robot that falls where the model grows at one rate: the prediction must find that rate."""
    borne = -0.5
    scales, times = np.arange(0.001, 0.0101, 0.0005).round(4).tolist(), [0.4, 0.6]

    def point(setting):
        stands = growth(setting.force_scale, setting.time_constant, setting.hip_gain) < borne
        return Point(setting, (Climb(8.0 if stands else 0.0, None, 1),))

    points = [point(Setting(s, t, *h)) for s in scales for t in times for h in HIPS]
    found = edges(replace(plane(), points=tuple(points)))
    for edge in found:
        assert edge.growth == pytest.approx(borne, abs=0.25)
        assert edge.predicted == pytest.approx(edge.with_hip, abs=0.0005)
        assert edge.with_hip > edge.without_hip


def posture() -> Array:
    angles = np.zeros(len(JOINTS))
    for side in 'lr':
        for name, angle in (('hip_pitch', -0.3), ('knee', 0.6), ('ankle_pitch', -0.3)):
            angles[JOINTS.index(f'{side}_{name}')] = angle
    return angles


@pytest.mark.parametrize('sides', ['l', 'r', 'lr'])
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
    for offset in (True, False):
        lift = Setting(0.004, 0.4, HIP_GAIN, offset).condition('bullet').scenario(0.0)
        seen = lift.table(HipControllerParameters).reference_offset
        assert (seen == 0.0) == (not offset)
    without = standing_loop(Setting(0.004, 0.4, 0.0).condition('bullet').scenario(0.0), 2)
    assert without.hip_gain == 0.0 and without.growth > two.growth
    stretched = standing_loop(scenario.changed({('simulator', 'servo_model'): 'stretch'}), 2)
    identified = standing_loop(scenario.changed({('simulator', 'servo_model'): 'pid'}), 2)
    assert identified.servos.back_emf.min() > 2.0 * stretched.servos.back_emf.max(), (
        'its derivative term'
    )
    assert identified.growth < stretched.growth


def test_page_says_where_a_loop_has_no_edge_in_the_plane():
    """With 0.7 s the ankles alone hold everywhere, and the hip's rate adds a degree."""

    def slow(point):
        limit = 7.0 if point.setting.hip_gain else 6.0
        return replace(point, climbs=(Climb(limit, 0.2, 9),) * 2)

    points = [slow(each) if each.setting.time_constant == 0.7 else each for each in plane().points]
    found = replace(plane(), points=tuple(points))
    text = page(found, compare_with_model(found), 'limits.png', 'swing.png')
    assert 'for the others it lies beyond the plane' in text and 'inf' not in text.split()
    whole = page(plane(), compare_with_model(plane()), 'limits.png', 'swing.png')
    assert 'beyond the plane' not in whole


@pytest.mark.slow
def test_page_picture_and_data_are_written(tmp_path):
    out = tmp_path / 'stage3.md'
    assert write(plane(), compare_with_model(plane()), out) == summary(plane())
    assert read_json(out.with_suffix('.json'), Plane) == plane()
    text = out.read_text(encoding='utf-8')
    assert (tmp_path / 'stage3.png').stat().st_size > 10_000
    assert "At 3 of 24 points the hip's rate raises the limit by 0.7 deg or more" in text
    assert 'the rate adds +0.00 deg on average' in text
    assert 'the offset adds +0.50 deg, +0.5 to +0.5' in text
    assert '| 0.5 | 4.50 |' in text and '7.6 (11)' in text and '0.0 (-)' in text


def test_a_seed_that_fell_before_leaves_no_overshoot():
    point = Point(POINT, (Climb(8.0, 0.2, 9), Climb(1.0, None, 5)))
    assert np.isnan(point.overshoot) and point.limit_deg == 4.5
    assert np.isnan(Point(POINT, (Climb(0.0, None, 1),)).overshoot)


@pytest.mark.slow
def test_a_plane_is_measured_once(tmp_path):
    """Far beyond the edge, so that few leg lifts are needed."""
    found = measure_plane(1, 'mujoco', 1, tmp_path, (0.02,), (0.2,))
    assert found.limits(0.0).tolist() == found.limits(HIP_GAIN).tolist() == [[0.0]]
    assert 4.0 < found.without.limit_deg < 9.0
    assert [check.limit_deg for check in found.checks] == [0.0] * 3, 'on the other engine as well'
    kept = (tmp_path / 'jobs.sqlite').read_bytes()
    assert len(read_store(tmp_path / 'jobs.sqlite', lambda data: data)[1]) == 7
    assert measure_plane(1, 'mujoco', 1, tmp_path, (0.02,), (0.2,)) == found
    assert (tmp_path / 'jobs.sqlite').read_bytes() == kept


@pytest.mark.parametrize(
    ('seeds', 'engine', 'word'), [(0, 'mujoco', '--seeds'), (1, 'abacus', 'engine')]
)
def test_arguments_are_refused(tmp_path, seeds, engine, word):
    with pytest.raises(KhrError, match=word):
        measure_plane(seeds, engine, 1, tmp_path, (0.002,), (0.5,))


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
