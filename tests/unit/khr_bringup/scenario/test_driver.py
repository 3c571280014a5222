"""What a driver, of the real robot too, leaves out of a graph, and how it is found."""

from pathlib import Path

import pytest

from khr_analysis.outcome import OBSERVED
from khr_bringup.board_loop import on_board
from khr_bringup.scenario.driver import OF_BOARD, OF_ROBOT, STATED, Driver, driver_of
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.interfaces import (
    CLOCK,
    FOOT_FORCES,
    GYRO,
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    STATE,
    TRUE_FORCES,
    TRUE_RATE,
)
from khr_hardware.parameters import BoardParameters
from tests.support.drivers import PENDULUM, install_example

SENSORS = {'gyro', 'foot_force'}


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', install_example(tmp_path)['AMENT_PREFIX_PATH'])
    return tmp_path


def driver(*publishes):
    return Driver('package', 'driver', tuple(publishes))


def nodes(*publishes):
    return set(load_scenario('stand_0deg').driven_by(driver(*publishes)).nodes)


def test_sensors_stay_where_the_driver_publishes_the_truth():
    truth = nodes(CLOCK, JOINT_STATES, *OBSERVED)
    assert truth >= SENSORS | {'run_phase', 'monitor'}
    assert 'simulator' not in truth
    assert not nodes(*OF_BOARD) & SENSORS
    half = nodes(CLOCK, JOINT_STATES, GYRO, *TRUE_FORCES)
    assert 'foot_force' in half
    assert 'gyro' not in half
    judged = [driver(*made).judged_by for made in ((CLOCK, *OBSERVED), OF_BOARD, (CLOCK, GYRO))]
    assert judged == ['truth', 'sensors', 'nothing']
    assert 'monitor' not in nodes(CLOCK, JOINT_STATES, GYRO)


def test_a_driver_that_reports_its_state_keeps_the_course_itself():
    assert 'run_phase' in nodes(*OF_BOARD)
    assert 'run_phase' not in nodes(*OF_BOARD, STATE)


def test_a_driver_runs_in_real_time_unless_it_is_stated():
    scenario = load_scenario('stand_0deg')
    assert scenario.driven_by(driver(*OF_BOARD)).values['simulator']['sync'] == 'realtime'
    stated = scenario.changed({('simulator', 'sync'): 'lockstep'})
    assert stated.driven_by(driver(*OF_BOARD)).values['simulator']['sync'] == 'lockstep'


def test_an_executable_is_found_where_ros_looks(prefix):
    found = driver_of(PENDULUM, '--driver')
    assert found.path == prefix / 'lib' / PENDULUM
    assert found.publishes == OF_BOARD


def test_a_package_says_what_its_driver_publishes(prefix):
    file = prefix / 'share' / 'khr_example_driver' / STATED
    file.parent.mkdir(parents=True)
    file.write_text(
        'pendulum: {publishes: [clock, ground_truth/imu]}\nother: {publishes: [clock]}\n'
    )
    assert driver_of(PENDULUM, '--driver').publishes == (CLOCK, TRUE_RATE)
    file.write_text('pendulum: {publishes: [clok]}\n')
    with pytest.raises(KhrError, match=r"pendulum: publishes: \['clok'\] is not accepted"):
        driver_of(PENDULUM, '--driver')


@pytest.mark.parametrize(
    ('text', 'reason'),
    [
        ('pendulum', 'accepted: PACKAGE/EXECUTABLE'),
        ('khr_example_driver/pendulun', 'no such executable'),
        ('khr_sim/gyro', 'khr_sim/gyro is no driver'),
    ],
)
def test_an_executable_that_is_no_driver_is_refused(prefix, text, reason):
    with pytest.raises(KhrError, match=reason):
        driver_of(text, '--driver')


# ---- the real robot ----

MIXING = 'board.mixing=board'


def driven(name, *changes):
    """Return a scenario on the board, as khr run --board prepares it."""
    return on_board(load_scenario(name).set_to(changes)).driven_by(driver_of(OF_ROBOT, '--board'))


def test_forces_judge_a_run_and_are_fed_back_where_the_map_has_them():
    scenario = driven('lift_7.6deg_ka12', 'board.map=khr3hv_forces')
    assert set(FOOT_FORCES) <= set(scenario.driver.publishes)
    assert scenario.of('monitor')['judge_by'] == 'sensors' and 'monitor' in scenario.nodes
    with pytest.raises(KhrError, match='ankle_controller needs the topic foot_force/left_toe'):
        driven('lift_7.6deg_ka12')
    assert 'monitor' not in driven('stand_0deg').nodes


def test_without_a_gyro_nothing_claims_a_pitch_rate(tmp_path):
    file = tmp_path / 'map.yaml'
    file.write_text('servos: khr3hv\ngyro: null\nforces: null')
    with pytest.raises(KhrError, match=f'needs the topic {GYRO.name}'):
        driven('walk_6.99deg_ka12', f'board.map={file}')
    with pytest.raises(KhrError, match='mixing: the map has no gyro'):
        driven('walk_6.99deg_ka12', f'board.map={file}', MIXING)


def test_the_description_is_published():
    scenario = driven('stand_0deg')
    assert ROBOT_DESCRIPTION in scenario.driver.publishes
    assert '<robot' in Path(scenario.table(BoardParameters).urdf).read_text()


def test_a_controller_that_the_board_has_no_means_for_is_refused():
    with pytest.raises(KhrError, match='roll_controller: the board cannot do its control'):
        driven('walk_6.99deg_ka12', MIXING, 'roll_controller.enabled=true')
