"""The recorder alone: whose clock it follows, and what it warns of when it closes."""

from pkgutil import resolve_name

import pytest

from khr_analysis.recorder_parameters import RECORDER
from khr_bringup.graph.run_registry import registered
from khr_common.interfaces import CLOCK, DIAGNOSTICS, GYRO, READY
from khr_sim.sensors import GYRO as GYRO_NODE
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


class SameProcess:
    """A recorder that knows the node beside it, and a stranger that publishes on its topic."""

    def __init__(self, folder):
        import rclpy
        from rclpy.experimental.events_executor import EventsExecutor
        from sensor_msgs.msg import Imu

        from khr_common.nodes.messages import restamp
        from khr_common.nodes.node import KhrNode

        self.recorder, self.node = resolve_name(RECORDER.node)(RECORDER), KhrNode(GYRO_NODE)
        self.clock, self.gyro = self.node.output(CLOCK), self.node.output(GYRO)
        self.recorder.join([self.node])
        self.stranger, self.folder = rclpy.create_node('stranger'), folder
        self.message, self._restamp = Imu(), restamp
        self._executor = EventsExecutor()
        for node in (self.recorder, self.node, self.stranger):
            self._executor.add_node(node)

    def until(self, condition, what):
        wait_for(lambda: self._executor.spin_once(0.02) or condition(), what)

    def publish(self, seconds):
        for output in (self.clock, self.gyro):
            output.fill(round(seconds * 1e9), [0.0] * 3 if output is self.gyro else [])
            output.send()

    def publish_strange(self, publisher, seconds):
        self._restamp(self.message.header.stamp, round(seconds * 1e9))
        publisher.publish(self.message)

    def times(self):
        """Close the bag; return the times of the gyro in it, s."""
        self.recorder.close()
        return [time_ns / 1e9 for time_ns, _ in Bag(self.folder)['/imu/data_raw']]


@pytest.fixture
def same_process(ros):
    return SameProcess(ros)


def test_messages_of_the_same_process_need_no_subscription(same_process):
    for seconds in (1.0, 2.0):
        same_process.publish(seconds)
        same_process.publish(seconds)  # repeated, as by a simulator that waits for others
    same_process.gyro.send()
    assert same_process.node.count_subscribers('imu/data_raw') == 0
    assert same_process.times() == [1.0, 2.0]


def test_a_topic_of_the_same_process_that_others_publish_too_has_each_message_once(same_process):
    same_process.publish(1.0)
    strange = same_process.stranger.create_publisher(type(same_process.message), GYRO.name, 10)
    same_process.until(strange.get_subscription_count, 'the recorder')
    for seconds in (2.0, 3.0):  # both are under way before the first is received
        same_process.publish(seconds)
    same_process.publish_strange(strange, 4.0)
    received = len(same_process.recorder._own['/imu/data_raw'])
    assert received == 2
    same_process.until(lambda: not same_process.recorder._own['/imu/data_raw'], 'both again')
    same_process.until(
        lambda: same_process.recorder._stamps[f'/{GYRO.name}'] == 4e9, 'the stranger'
    )
    assert same_process.times() == [1.0, 2.0, 3.0, 4.0]
