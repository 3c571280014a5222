"""What a driver leaves out of a graph, and how it is found."""

import pytest

from khr_analysis.outcome import OBSERVED
from khr_bringup.scenario.driver import OF_BOARD, STATED, Driver, driver_of
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.interfaces import CLOCK, GYRO, JOINT_STATES, STATE, TRUE_FORCES, TRUE_RATE
from tests.support.drivers import PENDULUM, install_example

SENSORS = {'gyro', 'foot_force'}


@pytest.fixture
def prefix(tmp_path, monkeypatch):
    monkeypatch.setenv('AMENT_PREFIX_PATH', install_example(tmp_path)['AMENT_PREFIX_PATH'])
    return tmp_path


def driver(*publishes):
    return Driver('package', 'driver', tuple(publishes))


def nodes(*publishes, scenario='stand_0deg'):
    return set(load_scenario(scenario).driven_by(driver(*publishes)).nodes)


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


def test_without_anything_to_judge_by_there_is_no_monitor():
    by_rate = load_scenario('walk_8.88deg_ka12').driven_by(driver(CLOCK, JOINT_STATES, GYRO))
    assert 'monitor' not in by_rate.nodes


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
def test_what_is_no_driver_is_refused(prefix, text, reason):
    with pytest.raises(KhrError, match=reason):
        driver_of(text, '--driver')
