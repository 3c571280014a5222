"""The signals of a run against the run itself."""

from pathlib import Path

import numpy as np
import pytest

from khr_bringup.balance import balance_of
from khr_bringup.changes import Change
from khr_bringup.recorded.run_signals import Series, constant_parts, run_with_series
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters

WEIGHT = 1.5 * 9.81  # N


@pytest.fixture(scope='module')
def standing():
    scenario = load_scenario('lift_3.8deg').set_to(
        ['simulator.duration=3.0', 'simulator.engine=mujoco']
    )
    return run_with_series(scenario)[1]


def test_signals_describe_what_the_robot_does(standing):
    np.testing.assert_allclose(np.diff(standing.time), 0.015, atol=1e-9)
    assert standing.inclination[0] == 0.0  # the board is level at the start, then tilted
    assert np.degrees(standing.inclination[-1]) == pytest.approx(3.8)
    # The robot leans with the board, its joints give, and its rate is the slope of its pitch.
    assert 3.3 < np.degrees(standing.pitch[-1] - standing.pitch[10]) < 5.5
    np.testing.assert_allclose(
        np.cumsum(standing.pitch_rate[11:]) * 0.015,
        standing.pitch[11:] - standing.pitch[10],
        atol=2e-3,
    )
    late = standing.time > 2.5
    weight = WEIGHT * np.cos(standing.inclination[late])
    np.testing.assert_allclose(standing.contact_force[late].sum(axis=1), weight, rtol=0.02)
    np.testing.assert_allclose(standing.foot_force[late].sum(axis=1), weight, rtol=0.05)
    assert not standing.correction.any()
    assert standing.slip[-1] < 0.002


def test_signals_survive_being_written(standing, tmp_path: Path):
    standing.save(tmp_path / 'run.npz')
    read = Series.load(tmp_path / 'run.npz')
    np.testing.assert_allclose(read.contact_force, standing.contact_force, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(read.time, standing.time, rtol=1e-6)
    assert [path.name for path in tmp_path.iterdir()] == ['run.npz']
    whole = (tmp_path / 'run.npz').read_bytes()
    version = whole.index(b'PK\1\2') + 6  # needed to extract the first file of the archive
    later = whole[:version] + b'\xbc' + whole[version + 1 :]
    for damaged in (b'', b'torn', whole[: len(whole) // 2], later):
        (tmp_path / 'run.npz').write_bytes(damaged)
        with pytest.raises(KhrError, match=r'run\.npz: not the signals of a run'):
            Series.load(tmp_path / 'run.npz')


def test_a_further_controller_has_a_column_of_its_own(tmp_path):
    on = {('roll_controller', key): value for key, value in (('enabled', True), ('gain', 12.0))}
    scenario = load_scenario('walk_3deg').changed({('simulator', 'duration'): 1.5, **on})
    _, series = run_with_series(scenario)
    assert series.controllers == ('ankle', 'hip', 'roll')
    roll = series.correction_of('roll')
    assert roll.any() and not series.correction_of('ankle').any()
    assert (series.columns['correction_roll'] == roll).all()
    assert np.isnan(series.correction_of('knee')).all()
    series.save(tmp_path / 'run.npz')
    read = Series.load(tmp_path / 'run.npz')
    assert read.controllers == series.controllers
    np.testing.assert_allclose(read.correction_of('roll'), roll, rtol=1e-6)
    assert read.during(read.time < 1.0).correction.shape[1] == 3


def test_the_estimate_of_the_recovery_is_near_the_truth_of_a_standing_robot():
    scenario = load_scenario('push_behind_step').changed({('simulator', 'duration'): 1.4})
    _, series = run_with_series(scenario)
    balance = balance_of(series, Robot.load(), scenario.table(RunParameters))
    assert np.abs(series.estimate_of('center') - balance.center)[-10:].max() < 0.005


WALK = load_scenario('walk_7.68deg_ka12')
TIMES = np.linspace(0.0, 4.0, 9)


def parts(changes=(), **set_):
    scenario = WALK.changed({tuple(name.split('__')): value for name, value in set_.items()})
    return constant_parts(scenario, changes, TIMES, np.zeros((len(TIMES), 0)))[:, 0]


def test_the_constant_part_is_the_correction_of_a_robot_that_does_not_move():
    still = {
        ('ankle_controller', 'enabled'): True,
        ('ankle_controller', 'gain'): 12.0,
        ('simulator', 'duration'): 3.0,
        ('ankle_controller', 'reference_offset'): -0.5,
        ('gyro', 'noise'): 0.0,
    }
    _, series = run_with_series(load_scenario('stand_0deg').changed(still))
    loop = series.correction[:, 0] - series.constant[:, 0]
    assert abs(series.constant[-1, 0]) > 0.0
    assert abs(loop[-20:]).max() < 0.3 * abs(series.constant[-1, 0])


def test_the_constant_part_follows_the_gain_from_the_sample_at_which_a_change_acts():
    before, change = parts(), Change('ankle_controller', 'gain', 24.0, 2_000_000_000)
    assert parts([change])[TIMES <= 2.0] == pytest.approx(before[TIMES <= 2.0])
    assert parts([change])[TIMES > 2.0] == pytest.approx(2.0 * before[TIMES > 2.0])


def test_the_constant_part_rises_with_the_start_ramp_and_forces_have_none():
    assert parts()[0] == 0.0 and parts()[1] == pytest.approx(0.5 * parts()[4])
    assert not parts(ankle_controller__source='force').any()
    assert not parts(ankle_controller__enabled=False).any()
