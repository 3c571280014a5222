"""The recorder node: every topic of the graph into a rosbag2, in simulated time."""

from __future__ import annotations

import importlib
from functools import partial
from pathlib import Path
from typing import Any, cast

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseArray, WrenchStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterEvent
from rclpy.clock import Clock as RclpyClock
from rclpy.clock import ClockType
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray

from khr_analysis.errors import AnalysisError
from khr_analysis.recording import SCENARIO_TOPIC, RecorderParameters, Recording
from khr_common import cdr
from khr_common.nodes.messages import little_endian
from khr_common.nodes.node import Listener
from khr_common.nodes.spin import run_node
from khr_common.stamps import StampedSet

REGIONS = ('left_toe', 'left_heel', 'right_toe', 'right_heel')
# What flows in every control period: the run starts when each of these has been heard.
DATA_TOPICS: dict[str, type[Any]] = {
    '/clock': Clock,
    'joint_states': JointState,
    'ground_truth/odom': Odometry,
    'ground_truth/imu': Imu,
    'ground_truth/soles': PoseArray,
    'imu/data_raw': Imu,
    'joint_reference': JointState,
    'ankle_controller/correction': JointState,
    'hip_controller/correction': JointState,
    **{f'ground_truth/contact/{region}': WrenchStamped for region in REGIONS},
    **{f'foot_force/{region}': WrenchStamped for region in REGIONS},
}
STAGE: dict[str, type[Any]] = {'stage': JointState}  # the same, if the run has stages
# What comes now and then, and must not be missed while the recorder searches for new topics.
EVENT_TOPICS: dict[str, type[Any]] = {
    'push': WrenchStamped,
    '/parameter_events': ParameterEvent,
    '/diagnostics': DiagnosticArray,
    'spectrum': Float64MultiArray,
    'spectrum/peaks': DiagnosticArray,
}
DEPTH = QoSProfile(depth=5000)
DEPTH_LATCHED = QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SEARCH_PERIOD = 0.5  # s of wall time between looks for new topics
# Spins of 20 ms without a message, after which there is none left: if the run has been heard
# whole, and if not, when the middleware may be about to send again what it has lost.
IDLE_SPINS, LOST_SPINS = 10, 50


class RecorderNode(Listener):
    """Record raw messages of all topics; stop, and say so, when the disk takes no more."""

    patience = 20.0

    def __init__(self) -> None:
        super().__init__('recorder', RecorderParameters)
        recording = Recording(Path(self.parameters.folder))
        self._recording: Recording | None = recording
        self._now = 0
        self._last: dict[str, bytes] = {}
        self._taken: set[str] = set()
        self._diagnostics = self.publish_on(DiagnosticArray, '/diagnostics')
        self._clock_topic = self.resolve_topic_name('/clock')
        data = DATA_TOPICS | (STAGE if self.parameters.staged else {})
        self._kinds = {self.resolve_topic_name(topic): kind for topic, kind in data.items()}
        self._instants = StampedSet(tuple(self._kinds))
        if self.parameters.scenario_file:
            text = Path(self.parameters.scenario_file).read_text(encoding='utf-8')
            self._attempt(lambda: recording.write_text(SCENARIO_TOPIC, text, 0))
        for topic, kind in (data | EVENT_TOPICS).items():
            self._record(recording, self.resolve_topic_name(topic), kind, latched=False)
        self.create_timer(
            SEARCH_PERIOD, self._search, clock=RclpyClock(clock_type=ClockType.STEADY_TIME)
        )
        self._idle_spins = 0

    def settled(self) -> bool:
        """Return whether all that was on its way has arrived: nothing came for some spins."""
        self._idle_spins += 1
        return self._idle_spins > (IDLE_SPINS if self.heard_all else LOST_SPINS)

    def close(self) -> None:
        """Finish the bag."""
        late = [topic for topic in self._kinds if self._stamp(topic) < self._now]
        if late:
            self.get_logger().warning(
                f'not heard up to t = {self._now / 1e9:.3f} s: {", ".join(late)}'
            )
        if self._recording is not None:
            recording, self._recording = self._recording, None
            self._attempt(recording.close)

    def _search(self) -> None:
        """Subscribe to what has appeared in the graph."""
        if self._recording is None:
            return
        for topic, kinds in self.get_topic_names_and_types():
            if topic in self._taken:
                continue
            publishers = self.get_publishers_info_by_topic(topic)
            if publishers:
                latched = all(
                    p.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
                    for p in publishers
                )
                self._record(self._recording, topic, _message_class(kinds[0]), latched)

    def _record(self, recording: Recording, topic: str, kind: type[Any], latched: bool) -> None:
        self._taken.add(topic)
        name = f'{kind.__module__.split(".")[0]}/msg/{kind.__name__}'
        try:
            recording.add_topic(topic, name, latched)
        except AnalysisError as error:
            self.get_logger().warning(str(error))
            return
        self.create_subscription(
            kind,
            topic,
            partial(self._on_message, topic),
            DEPTH_LATCHED if latched else DEPTH,
            raw=True,
        )

    def _on_message(self, topic: str, data: bytes) -> None:
        self._idle_spins = 0
        if topic in self._kinds:
            if self._last.get(topic) == data:
                return  # the simulator asked again for what it missed
            self._last[topic] = data
            stamp_ns = self._stamp(topic)
            if topic == self._clock_topic:
                self._now = stamp_ns
            if self._instants.put(topic, stamp_ns, None) is not None:
                self.heard(stamp_ns)
        recording = self._recording
        if recording is not None:
            self._attempt(lambda: recording.write(topic, data, self._now))

    def _stamp(self, topic: str) -> int:
        """Return the newest stamp of a topic, ns; negative before the first."""
        data = self._last.get(topic)
        return -1 if data is None else cdr.clock(little_endian(data, self._kinds[topic]))

    def _attempt(self, action: Any) -> None:
        try:
            action()
        except OSError as error:
            self._recording = None
            reason = f'recording stopped: {error}'
            self.get_logger().error(reason)
            self._diagnostics.publish(
                DiagnosticArray(
                    status=[
                        DiagnosticStatus(
                            level=DiagnosticStatus.ERROR,
                            name='recorder',
                            message=reason,
                            values=[KeyValue(key='folder', value=self.parameters.folder)],
                        )
                    ]
                )
            )


def _message_class(kind: str) -> type[Any]:
    package, _, name = kind.split('/')
    return cast(type[Any], getattr(importlib.import_module(f'{package}.msg'), name))


def main() -> int:
    """Run the recorder node."""
    return run_node(RecorderNode)


if __name__ == '__main__':
    raise SystemExit(main())
