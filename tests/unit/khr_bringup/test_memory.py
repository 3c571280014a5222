"""A long bag is read in the room of its numbers."""

import struct
import tracemalloc

import pytest

from khr_analysis.recording import Recording
from khr_bringup.recorded.bags import Samples, read_messages
from khr_common.interfaces import GYRO

INSTANTS = 20_000


def test_the_samples_of_a_bag_take_the_room_of_their_numbers(tmp_path):
    recording = Recording(tmp_path / 'bag')
    recording.add_topic('/imu/data_raw', GYRO.kind)
    for number in range(INSTANTS):
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
    assert len(samples) == INSTANTS
    assert next(iter(samples)) == (0, (0.0, 0.0, 0.0))
    assert kept < 60 * INSTANTS, 'a stamp and three numbers take 32 bytes; tuples took 250'


def test_samples_of_another_width_are_refused():
    samples = Samples()
    samples.append((0, (1.0, 2.0)))
    with pytest.raises(ValueError, match='1 numbers in one message, 2 in another'):
        samples.append((1, (1.0,)))
