"""The robots and signals that a bag gives, also where it is damaged or lacks some."""

import struct
import tracemalloc

import numpy as np

from khr_analysis.recording import Recording
from khr_bringup.changes import Change
from khr_bringup.recorded.bag_signals import series_of, signal_topics
from khr_bringup.recorded.bags import Samples, read_messages
from khr_bringup.scenario.scenario import Scenario
from khr_common.interfaces import (
    BOARD_CORRECTION,
    GYRO,
    RECOVERY_STATE,
    STAGE,
    TRUE_FORCES,
    TRUE_POSE,
    TRUE_RATE,
    TRUE_SOLES,
)
from khr_common.stamps import SYSTEM_TIME

EMPTY = Scenario('', {})
STANDING = {
    TRUE_RATE: (0.0, 0.1, 0.0),
    TRUE_POSE: (0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0),
    TRUE_SOLES: (0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -0.05, 0.0, 0.0, 0.0, 0.0, 1.0),
    **dict.fromkeys(TRUE_FORCES, (0.0, 0.0, 3.7)),
}


def read(signals, scenario=EMPTY, changes=()):
    """Return the signals, and the outcome, of a bag that holds these samples alone."""
    messages = {topic: Samples() if topic.flow == 'period' else [] for topic in signal_topics()}
    for topic, samples in signals.items():
        for sample in samples:
            messages[topic].append(sample)
    return series_of(messages, scenario, changes)


def test_signals_that_a_bag_lacks_are_nan():
    series, _ = read({TRUE_RATE: [(stamp, (0.0, 1.0, 0.0)) for stamp in (0, 15_000_000)]})
    assert (series.pitch_rate == 1.0).all()
    for lacking in (series.inclination, series.pitch, series.slip, series.foot_force):
        assert np.isnan(lacking).all()
    assert series.foot_force.shape == (2, 4)
    assert series.estimate is None


def test_corrections_of_the_board_stand_for_those_of_the_controllers():
    added = [(stamp, (0.1, 0.1, 0.2, 0.2)) for stamp in (0, 15_000_000)]
    series, _ = read({BOARD_CORRECTION: added})
    assert (series.correction_of('ankle') == 0.1).all()
    assert (series.correction_of('hip') == 0.2).all()


def test_the_recovery_node_s_estimate_is_there_if_the_node_is():
    states = [(stamp, (1.0, 0.01, 0.02, 1.0)) for stamp in (0, 15_000_000)]
    series, _ = read({RECOVERY_STATE: states})
    assert (series.estimate_of('center') == 0.01).all()
    assert (series.columns['estimate_capture'] == 0.02).all()
    assert 'estimate_capture, m' in series.with_units


def test_a_stage_that_was_lost_is_the_last_known():
    times = [15_000_000 * n for n in range(5)]
    stages = [(times[n], (stage, 0.1, 1.0, 1.0)) for n, stage in ((1, 1.0), (3, 2.0))]
    series, _ = read({TRUE_RATE: [(each, (0.0, 1.0, 0.0)) for each in times], STAGE: stages})
    assert series.stage.tolist() == [1.0, 1.0, 1.0, 2.0, 2.0]
    assert (series.read_inclination == 0.1).all()


def test_a_recording_is_judged_with_the_changes_of_its_monitor():
    times = [15_000_000 * n for n in range(60)]
    messages = {topic: [(time, numbers) for time in times] for topic, numbers in STANDING.items()}
    higher = Change('monitor', 'fall_height', 1.0, times[20])
    sunk = (0.0, 0.0, 0.29, 0.0, 0.0, 0.0, 1.0)
    messages[TRUE_POSE] = [*messages[TRUE_POSE][:5], *((time, sunk) for time in times[5:])]
    assert read(messages)[1].verdict == 'stood'
    outcome = read(messages, changes=[higher])[1]
    assert (outcome.verdict, outcome.fell_at) == ('fell', times[21] / 1e9)


def test_damaged_instant_is_nan_and_does_not_stop_the_rest():
    times = [0, 15_000_000, 30_000_000]
    messages = {topic: [(time, numbers) for time in times] for topic, numbers in STANDING.items()}
    messages[TRUE_RATE][1] = (times[1], (0.0, np.nan, 0.0))
    series, _ = read(messages)
    np.testing.assert_array_equal(series.distance, [0.0, np.nan, 0.0])
    np.testing.assert_array_equal(series.pitch, 0.0)


def test_the_time_of_a_driver_on_system_time_counts_from_its_first_stamp():
    scenario = EMPTY.changed(
        {
            ('monitor', 'motion_end'): 1.0,
            ('ankle_controller', 'enabled'): True,
            ('ankle_controller', 'reference_offset'): -0.7,
        }
    )
    found = [
        read(
            {
                topic: [(origin + 15_000_000 * n, numbers) for n in range(100)]
                for topic, numbers in STANDING.items()
            },
            scenario,
        )
        for origin in (0, SYSTEM_TIME + 123)
    ]
    (simulated, one), (of_system, other) = found
    assert one == other and one.time == 1.485
    np.testing.assert_array_equal(of_system.time, simulated.time)
    np.testing.assert_array_equal(of_system.constant, simulated.constant)
    assert abs(simulated.constant[0]).max() < abs(simulated.constant[-1]).max(), 'a start ramp'


def test_the_samples_of_a_bag_take_the_room_of_their_numbers(tmp_path):
    count = 20_000
    recording = Recording(tmp_path / 'bag')
    recording.add_topic('/imu/data_raw', GYRO.kind)
    for number in range(count):
        stamp = struct.pack('<iI', *divmod(number * 15_000_000, 10**9))
        header = b'\0\1\0\0' + stamp + struct.pack('<I', 1) + b'\0' + bytes(7)
        recording.write('/imu/data_raw', header + bytes(37 * 8), number * 15_000_000)
    recording.close()
    tracemalloc.start()
    try:
        before = tracemalloc.get_traced_memory()[0]
        samples = read_messages(tmp_path / 'bag', [GYRO])[GYRO]
        kept = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert len(samples) == count
    assert next(iter(samples)) == (0, (0.0, 0.0, 0.0))
    assert kept < 60 * count, 'a stamp and three numbers take 32 bytes; tuples took 250'
