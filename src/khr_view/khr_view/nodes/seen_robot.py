"""A robot of the run, as the page sees it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64MultiArray, String

from khr_analysis.outcome import Outcome
from khr_bringup.changes import changes_in
from khr_bringup.recorded.events import Event, number, received_push
from khr_common import cdr
from khr_common.cdr import Floats
from khr_common.errors import KhrError, MalformedError, one_line
from khr_common.interfaces import (
    DIAGNOSTICS,
    PEAKS,
    PUSH,
    PUSHED,
    ROBOT_DESCRIPTION,
    SPECTRUM,
    STAGE,
    STATE,
    WORLD,
    Topic,
)
from khr_common.nodes.messages import little_endian, message_class
from khr_common.nodes.node import KhrNode
from khr_common.stamps import RunTime
from khr_common.statuses import check_run, check_status, real
from khr_description.robot import Robot
from khr_view.charts.charts import BALANCE, CONSTANT, SLIP, polled_topics
from khr_view.charts.spectrum_lines import (
    Array,
    PlacedPeak,
    belong_together,
    bins_in,
    peaks_in,
    spectrum_lines,
)
from khr_view.charts.traces import Traces
from khr_view.model.live_run import LiveRun
from khr_view.model.scene import NEEDED, LiveScene
from khr_view.nodes.run_client import RunClient
from khr_view.page.display import Display
from khr_view.page.panels import LivePanel

DEPTH = 64  # messages of a topic between two frames: 10 times real time at 30 frames/s


class LatestMessages:
    """Subscriptions without callbacks: the middleware keeps the last messages until polled.

    They are best effort, so no publisher waits for them or stores messages. Their node is on no
    executor, so a message that is not polled is not deserialized.

    Args:
        node: of the run and namespace.
        topics: to subscribe to.
        depth: messages of each topic that are kept.
        robot: of a bout, that has the topics.
    """

    def __init__(
        self, node: KhrNode, topics: Sequence[Topic], depth: int, robot: str = ''
    ) -> None:
        self._run = node.run
        # Its name begins with an underscore: ROS 2 tools do not list it.
        self._node: Node = rclpy.create_node(
            f'_{node.get_name()}_poll',
            namespace=robot or node.get_namespace(),
            context=node.context,
            start_parameter_services=False,
            enable_rosout=False,
            use_global_arguments=False,
        )
        qos = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        self._subscriptions = [
            (
                topic,
                self._node.create_subscription(
                    message_class(topic.kind), topic.name, lambda _: None, qos, raw=True
                ),
            )
            for topic in topics
        ]

    def take(self) -> Iterator[tuple[Topic, int, Floats]]:
        """Yield topic, stamp in ns and numbers of each new message.

        A message that is unreadable or has a number that is not finite is skipped.
        """
        for topic, subscription in self._subscriptions:
            kind, read = message_class(topic.kind), cdr.numbers_of(topic)
            while True:
                with subscription.handle:
                    taken = subscription.handle.take_message(kind, True)
                if taken is None:
                    break
                try:
                    data = little_endian(taken[0], kind)
                    if topic.of_run:
                        check_run(cdr.frame(data), self._run)
                    found = cdr.clock(data), read(data)
                except (MalformedError, *cdr.UNREADABLE):
                    continue
                if isfinite(sum(found[1])):
                    yield topic, *found

    def close(self) -> None:
        """Leave the topics."""
        self._node.destroy_node()


class SeenRobot:
    """The signals and reports of one robot.

    Args:
        node: of the page.
        name: of the robot in a bout; empty for one robot alone.
        number: of the robot on the page, from 0.
        display, panel: show it.
        client: takes reported parameter changes.
        described: called once its description has come.

    Attributes:
        name: of the robot.
        robot: its description; None before it has come.
        run, scene, traces: its state, pose and signals so far.
    """

    def __init__(
        self,
        node: KhrNode,
        name: str,
        number: int,
        display: Display,
        panel: LivePanel,
        client: RunClient,
        described: Callable[[], None],
    ) -> None:
        self.name, self._number, self._described = name, number, described
        self._identity, self._client = node.run, client
        self._display, self._panel = display, panel
        self.robot: Robot | None = None
        self.run, self.scene, self.traces = LiveRun(), LiveScene(), Traces()
        topics = tuple(dict.fromkeys((*NEEDED, *polled_topics(), STAGE)))
        self._time = RunTime()
        self._samples = LatestMessages(node, topics, DEPTH, name)
        self._push = node.publisher(PUSH.under(name))
        self._tones: list[PlacedPeak] = []
        self._bins: tuple[Array, Array] | None = None
        callbacks: dict[Any, Any] = {
            ROBOT_DESCRIPTION: self.on_description,
            STATE: self._on_state,
            DIAGNOSTICS: partial(self._on_diagnostics, name),
            SPECTRUM: self._on_spectrum,
            PEAKS: self._on_peaks,
            PUSHED: self._on_push,
        }
        for topic, callback in callbacks.items():
            node.subscribe(topic.under(name), callback)
        if name:
            node.subscribe(DIAGNOSTICS, partial(self._on_diagnostics, ''))  # of the simulator

    def look(self) -> bool:
        """Take the newest samples; return whether there were some."""
        fresh = False
        for topic, stamp_ns, numbers in self._samples.take():
            fresh, stamp_ns = True, self._time.since_start(stamp_ns)
            balance = self.scene.take(topic, stamp_ns, numbers)
            now = self.run.now = stamp_ns / 1e9
            if balance is not None:
                stage = self.scene.signals.get(STAGE, ())
                self.traces.add(BALANCE, stamp_ns, balance)
                self.traces.add(CONSTANT, stamp_ns, self.run.constants(now, stage))
            if topic in polled_topics():
                self.traces.add(topic, stamp_ns, numbers)
        self.run.status.stage = int(self.scene.signals.get(STAGE, (0,))[0])
        return fresh

    def push(self, force: tuple[float, float, float]) -> None:
        """Push the torso, N in odom."""
        message = WrenchStamped()
        message.header.frame_id = WORLD
        vector = message.wrench.force
        vector.x, vector.y, vector.z = map(float, force)
        self._push.publish(message)

    def close(self) -> None:
        """Leave the topics."""
        self._samples.close()

    # ---- topics that are not periodic ----

    def on_description(self, message: String) -> None:
        """Take the description of the robot; the first one counts."""
        try:
            robot = self.scene.describe(message.data)
        except KhrError as error:
            self.run.trouble = str(error)
            return
        if robot is None:
            return
        self.scene.configure(self.run.of('simulator'))
        self.robot = robot
        self._described()

    def _on_state(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        check_status(values, self._identity)
        self.run.reported = time.monotonic()
        self.run.status.state = one_line(status.message)
        self.run.trouble = one_line(values.get('reason', ''))
        self._panel.show_state(status.message)

    def _on_diagnostics(self, robot: str, array: DiagnosticArray) -> None:
        changes = changes_in([array])
        self._client.on_changes(changes, robot)
        self.traces.events += [
            Event(each.time, f'{each.node}.{each.parameter} = {number(each.value)}')
            for each in changes
        ]
        for status in array.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == 'monitor' and 'time' in values:
                self.run.status.monitor(status.message, values)
                outcome = self.run.status.outcome
                if isinstance(outcome, Outcome):
                    fell = Event(outcome.fell_at, 'fell') if outcome.fell_at is not None else None
                    if fell and fell not in self.traces.events:
                        self.traces.events.append(fell)
                    stamp_ns = round(1e9 * real(values, 'time'))
                    self.traces.add(SLIP, stamp_ns, (outcome.slip_distance,))
            elif 'sync' in values:  # from the simulator or a driver
                self.run.status.simulator(values)
                self._panel.show_sync(values['sync'])
                self.run.reported = time.monotonic()

    def _on_peaks(self, array: DiagnosticArray) -> None:
        self._tones = peaks_in(array)
        self._show_spectrum()

    def _on_spectrum(self, message: Float64MultiArray) -> None:
        self._bins = bins_in(message)
        self._show_spectrum()

    def _show_spectrum(self) -> None:
        """Draw the spectrum once its bins and its peaks, which come in two messages, are there."""
        if self._bins and self._display.readers and belong_together(*self._bins, self._tones):
            lines = spectrum_lines(*self._bins, self._tones, self.run.motion.cycle)
            self._display.show_spectrum(lines, self._number)

    def _on_push(self, message: WrenchStamped) -> None:
        force = message.wrench.force
        if not isfinite(force.x + force.y + force.z):
            raise MalformedError('numbers that are not finite')
        self.traces.events.append(received_push(message))
        if message.header.frame_id in ('', WORLD) and self.scene.snapshot is not None:
            acting = np.array((force.x, force.y, force.z))
            self._display.show_push(self.scene.snapshot, acting, acts=True, number=self._number)
