"""The recorder alone: whose clock it follows, and what it warns of when it closes."""

from pkgutil import resolve_name

import pytest

from khr_analysis.recorder_parameters import RECORDER
from khr_bringup.graph.run_registry import registered
from khr_common.interfaces import DIAGNOSTICS, READY
from tests.support.runs import Bag, wait_for

TOPICS = 'clock rosgraph_msgs/msg/Clock period, imu/data_raw sensor_msgs/msg/Imu period'


class Sources:
    """Recorder, a driver's clock and its gyro on one executor."""

    def __init__(self, folder):
        import rclpy
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.experimental.events_executor import EventsExecutor
        from rclpy.time import Time
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import Imu
        from std_msgs.msg import String

        from khr_common.nodes.node import LATCHED

        self._time, self._clock, self._imu = Time, Clock, Imu
        self.recorder = resolve_name(RECORDER.node)(RECORDER)
        self.folder = folder
        self.driver = rclpy.create_node('driver')
        self.clock = self.driver.create_publisher(Clock, 'clock', 10)
        self.imu = self.driver.create_publisher(Imu, 'imu/data_raw', 10)
        self.said = []
        self.driver.create_subscription(
            String, READY.name, lambda m: self.said.append(m.data), LATCHED
        )
        self.driver.create_subscription(
            DiagnosticArray,
            DIAGNOSTICS.name,
            lambda m: self.said.extend(each.message for each in m.status),
            10,
        )
        self.recorder.join([])
        self._executor = EventsExecutor()
        for node in (self.recorder, self.driver):
            self._executor.add_node(node)
        self.until(lambda: self.clock.get_subscription_count(), 'the recorder')
        self.until(lambda: self.imu.get_subscription_count(), 'the recorder')

    def until(self, condition, what):
        wait_for(lambda: self._executor.spin_once(0.02) or condition(), what)

    def publish(self, seconds, clock=None):
        """Publish an instant of the clock, and of the gyro unless the clock is another one."""
        stamp = self._time(seconds=seconds).to_msg()
        (clock or self.clock).publish(self._clock(clock=stamp))
        if clock is None:
            message = self._imu()
            message.header.stamp = stamp
            self.imu.publish(message)

    def second_clock(self):
        import rclpy

        stranger = rclpy.create_node('stranger')
        clock = stranger.create_publisher(self._clock, 'clock', 10)
        self.until(lambda: self.recorder.count_publishers('clock') > 1, 'the second clock')
        self.until(lambda: clock.get_subscription_count(), 'the recorder')
        return clock


@pytest.fixture
def ros(tmp_path, monkeypatch):
    """ROS with the parameters of a recorder; return the folder of its bag."""
    import rclpy

    with registered('recorder', tmp_path) as entry:
        for key, value in {**entry.environment(), 'ROS_LOG_DIR': str(tmp_path)}.items():
            monkeypatch.setenv(key, value)
        own = {'folder': tmp_path / 'bag', 'topics': f'[{TOPICS}]'}
        words = [
            word for name, value in own.items() for word in ('-p', f'recorder:{name}:={value}')
        ]
        rclpy.init(args=['--ros-args', *words])
        try:
            yield tmp_path / 'bag'
        finally:
            rclpy.try_shutdown()


@pytest.fixture
def sources(ros):
    return Sources(ros)


@pytest.mark.parametrize(('behind', 'warned'), [(0.06, False), (0.5, True)])
def test_topics_that_stop_with_the_run_are_no_loss_but_those_that_stop_before(
    sources, capfd, behind, warned
):
    """Where all nodes are interrupted at once, nobody answers the last instants any more."""
    sources.publish(1.0)
    sources.until(
        lambda: any(each.startswith(f'recorder {10**9} ') for each in sources.said), 'the instant'
    )
    sources.publish(1.0 + behind, sources.clock)
    sources.until(lambda: sources.recorder.now_ns == round((1.0 + behind) * 1e9), 'the clock')
    sources.recorder.close()
    said = f'not received up to t = {1.0 + behind:.3f} s: /imu/data_raw'
    assert (said in capfd.readouterr().err) is warned


def test_a_second_clock_begins_no_other_bag(sources):
    sources.publish(1.0)
    sources.until(lambda: sources.recorder.now_ns == 10**9, 'the first clock')
    stranger = sources.second_clock()
    sources.publish(0.0, stranger)
    sources.until(lambda: any('of a second clock' in each for each in sources.said), 'its refusal')
    sources.publish(2.0)
    sources.until(lambda: sources.recorder.now_ns == 2 * 10**9, 'the first clock')
    sources.recorder.close()
    assert [path.name for path in sources.folder.parent.glob('bag*')] == ['bag']
    times = [time_ns for time_ns, _ in Bag(sources.folder)['/clock']]
    assert times == [10**9, 2 * 10**9]


def test_what_comes_before_the_clock_has_the_time_of_its_first_message(sources):
    sources.imu.publish(sources._imu())
    sources.until(lambda: sources.recorder._early, 'the early message')
    sources.publish(1.7e9, sources.clock)
    sources.until(lambda: sources.recorder.now_ns, 'the clock')
    sources.recorder.close()
    bag = Bag(sources.folder)
    assert {time_ns for topic in bag for time_ns, _ in bag[topic]} == {1_700_000_000 * 10**9}
    assert len(bag['/imu/data_raw']) == len(bag['/clock']) == 1


def test_what_came_is_recorded_though_no_clock_did(sources):
    sources.imu.publish(sources._imu())
    sources.until(lambda: sources.recorder._early, 'the early message')
    sources.recorder.close()
    assert len(Bag(sources.folder)['/imu/data_raw']) == 1


def test_a_clock_that_goes_back_ends_the_run_by_name(sources):
    sources.publish(2.0)
    sources.until(lambda: sources.recorder.now_ns == 2 * 10**9, 'the clock')
    sources.publish(0.0, sources.clock)
    sources.until(lambda: sources.recorder.failure, 'the failure')
    assert sources.recorder.failure == 'clock: time went back from 2.000 s to 0.000 s'
    sources.recorder.close()
