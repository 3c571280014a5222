"""A driver whose samples make no run: each fault is named by topic, quality and timestamp."""

import pytest
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu

from khr_bringup.graph import sensor_watch
from khr_bringup.graph.sensor_watch import SensorWatch
from khr_common.interfaces import GYRO, TRUE_RATE
from tests.support.runs import wait_for

BEST_EFFORT = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


@pytest.fixture
def sent(monkeypatch):
    """Return a function that publishes an Imu per (topic, stamp in s), and returns the watch."""
    monkeypatch.setattr(sensor_watch, 'PERIOD', 0.0)
    rclpy.init(domain_id=87)
    node = rclpy.create_node('driver')

    def send(*samples, watched=(GYRO, TRUE_RATE), qos=10):
        watch = SensorWatch(node, watched)
        publishers = {name: node.create_publisher(Imu, name, qos) for name, _ in samples}
        for name, publisher in publishers.items():
            for stamp in (stamp for other, stamp in samples if other == name):
                message = Imu()
                message.header.stamp.sec = stamp
                publisher.publish(message)
        wanted = {
            topic: sum(name == topic.name for name, _ in samples)
            for topic in watched
            if topic.name in publishers
        }

        def all_came():
            rclpy.spin_once(node, timeout_sec=0.05)
            return all(len(watch._stamps[topic]) == wanted[topic] for topic in wanted)

        if samples:
            wait_for(all_came, 'the samples')
        return watch

    yield send
    node.destroy_node()
    rclpy.shutdown()


def test_equal_timestamps_have_no_fault(sent):
    watch = sent((GYRO.name, 1), (GYRO.name, 2), (TRUE_RATE.name, 2))
    assert watch.faults() == [] == watch.notes


def test_a_missing_topic_is_named_with_the_one_of_its_type(sent):
    watch = sent(('imu/data', 1), (TRUE_RATE.name, 1))
    assert watch.faults() == ['imu/data_raw: no publisher (/imu/data is of its type: remap it)']


def test_timestamps_that_differ_are_zero_or_stay_are_named(sent):
    watch = sent((GYRO.name, 1), (TRUE_RATE.name, 3), (TRUE_RATE.name, 4))
    (text,) = watch.faults()
    assert text.startswith('timestamps that differ') and 'imu/data_raw 1.000 s' in text


@pytest.mark.parametrize(('stamp', 'says'), [(0, 'are zero'), (7, 'stays at 7.000 s')])
def test_timestamps_that_stay_are_named(sent, stamp, says):
    watch = sent((GYRO.name, stamp), (GYRO.name, stamp), watched=(GYRO,))
    wait_for(lambda: watch.faults() or watch._node, 'the fault')
    (text,) = watch.faults()
    assert says in text


@pytest.mark.parametrize('later', [1_000, 5])
def test_a_clock_that_is_set_is_noted_once(sent, later):
    stamps = [(name, stamp) for name in (GYRO.name, TRUE_RATE.name) for stamp in (100, 101, later)]
    (note,) = sent(*stamps).notes
    assert note.startswith('imu/data_raw: its timestamps jump by ') and f'{later - 101} s' in note


def test_best_effort_is_noted(sent):
    watch = sent((GYRO.name, 1), watched=(GYRO,), qos=BEST_EFFORT)
    assert watch.notes == ['imu/data_raw: published best effort: samples may be missing']
