"""Whether the robot fell, by gyro and foot forces alone: beside what the truth says."""

import pytest

from khr_analysis.outcome import SENSED, MonitorParameters
from khr_analysis.sensed_outcome import SensedMonitor
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from khr_common.interfaces import FOOT_FORCES, GYRO


def sensed(scenario):
    """Return the outcome of a run by the truth and by the sensors."""
    monitor, found = SensedMonitor(scenario.table(MonitorParameters)), []

    def watch(truth, loop, _):
        signals = {topic: loop.signals[topic] for topic in SENSED}
        found.append(monitor.update(truth.stamp_ns, signals))

    return run_offline(scenario, watch), found[-1]


@pytest.mark.parametrize(
    ('enabled', 'verdicts'), [(True, ('walked', 'upright')), (False, ('fell', 'fell'))]
)
def test_a_fall_is_sensed_and_a_walk_is_none(enabled, verdicts):
    scenario = load_scenario('walk_8.88deg_ka12').changed(
        {
            ('ankle_controller', 'enabled'): enabled,
            ('simulator', 'stop_when_tilted_deg'): 180.0,
            ('simulator', 'duration'): 8.0,
            ('simulator', 'engine'): 'mujoco',
        }
    )
    result, outcome = sensed(scenario)
    assert (result.verdict, outcome.verdict) == verdicts


def samples(rate, force, count):
    return [{GYRO: (0.0, rate, 0.0), **dict.fromkeys(FOOT_FORCES, (0.0, 0.0, force))}] * count


@pytest.mark.parametrize(
    ('course', 'verdict'),
    [
        ([(0.1, 4.0, 200), (0.1, 0.0, 200)], 'upright'),  # lifted by hand
        ([(0.1, 4.0, 200), (5.0, 4.0, 10), (0.1, 4.0, 200)], 'upright'),  # stumbles
        ([(0.1, 4.0, 200), (5.0, 4.0, 10), (0.1, 0.0, 100)], 'fell'),
    ],
)
def test_it_takes_a_fast_turn_and_then_no_load(course, verdict):
    monitor = SensedMonitor(MonitorParameters())
    signals = [each for rate, force, count in course for each in samples(rate, force, count)]
    for k, each in enumerate(signals):
        outcome = monitor.update(k * 15_000_000, each)
    assert outcome.verdict == verdict
