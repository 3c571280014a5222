"""A robot of the run, as the page sees it."""

from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import WrenchStamped

from khr_common.interfaces import PUSH, STAGE, WORLD
from khr_common.nodes.node import KhrNode
from khr_common.stamps import RunTime
from khr_description.robot import Robot
from khr_view.charts.charts import BALANCE, CONSTANT, polled_topics
from khr_view.charts.traces import Traces
from khr_view.model.live_run import LiveRun
from khr_view.model.live_scene import LiveScene
from khr_view.model.snapshot import NEEDED
from khr_view.nodes.latest_messages import LatestMessages
from khr_view.nodes.reports import Reports
from khr_view.nodes.run_client import RunClient
from khr_view.page.display import Display
from khr_view.page.live_panel import LivePanel

DEPTH = 64  # messages of a topic between two frames: 10 times real time at 30 frames/s


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
        reports: of the topics that are not periodic.
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
        self.name, self._described = name, described
        self.robot: Robot | None = None
        self.run, self.scene, self.traces = LiveRun(), LiveScene(), Traces()
        topics = tuple(dict.fromkeys((*NEEDED, *polled_topics(), STAGE)))
        self._time = RunTime()
        self._samples = LatestMessages(node, topics, DEPTH, name)
        self._push = node.publisher(PUSH.under(name))
        self.reports = Reports(
            node,
            self.run,
            self.scene,
            self.traces,
            display,
            panel,
            client,
            self._on_robot,
            name,
            number,
        )

    def _on_robot(self, robot: Robot) -> None:
        self.robot = robot
        self._described()

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
