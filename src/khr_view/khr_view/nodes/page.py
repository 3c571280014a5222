"""The page node: it observes a graph and shows it in browsers."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import String

from khr_common.block import NodeSpec
from khr_common.errors import KhrError
from khr_common.interfaces import (
    JOINT_STATES,
    PUSH,
    PUSHED,
    ROBOT_DESCRIPTION,
    STAGE,
    TRUE_POSE,
    WORLD,
)
from khr_common.nodes.node import KhrNode
from khr_description.robot import Robot
from khr_view.charts.charts import BALANCE, CONSTANT, polled_topics
from khr_view.charts.traces import Traces
from khr_view.controls import WATCHED, Control, Tunable, Value, tunables
from khr_view.guard import listen
from khr_view.live_page import LivePage
from khr_view.model.attempts import HEADS, heading
from khr_view.model.live_run import LiveRun
from khr_view.model.live_scene import LiveScene
from khr_view.model.restart import EndAction, RestartTimer
from khr_view.model.snapshot import NEEDED
from khr_view.nodes.latest_messages import LatestMessages
from khr_view.nodes.reports import Reports
from khr_view.nodes.run_client import RunClient
from khr_view.page.display import Note
from khr_view.session import Session

DEPTH = 64  # messages of a topic between two frames: 10 times real time at 30 frames/s
CHARTS_EVERY, STATUS_EVERY = 3, 6  # frames
DISCOVER_EVERY = 30  # frames between checks for new nodes
NO_TRUTH = 'the driver does not know the pose: drawn upright, on level ground'


class PageNode(KhrNode):
    """Show robot, signals and spectrum of one run; pass on the reader's actions.

    Args:
        spec: of the node.
        page: to show the run on; by default one of the node's own, at its parameters' address.
    """

    def __init__(self, spec: NodeSpec, page: LivePage | None = None) -> None:
        super().__init__(spec)
        p = self.parameters
        self._closes_page = page is None
        if page is None:
            guard = listen(p.host, p.port)
            page = LivePage(guard)
            print(f'page: {guard.address}', file=sys.stderr, flush=True)
        self._page, self._display, self._panel = page, page.display, page.panel
        self._session = page.session
        self._run, self._restart_timer = LiveRun(), RestartTimer()
        if self._session is not None:
            self._run.status.scenario = self._session.scenario.title
        self._scene, self._traces = LiveScene(), Traces()
        self._count = 0
        topics = tuple(dict.fromkeys((*NEEDED, *polled_topics(), STAGE)))
        self._samples = LatestMessages(self, topics, DEPTH)
        self._push = self.publisher(PUSH)
        self._client = RunClient(
            self, (*tunables(), *WATCHED), self._on_control, self._on_value, self.show_refusal
        )
        self._reports = Reports(
            self,
            self._run,
            self._scene,
            self._traces,
            self._display,
            self._panel,
            self._client,
            self.push,
        )
        self._display.restart()
        self._show_attempts()
        self._panel.begin(self, self._session.scenario if self._session else None)
        self.by_wall_clock(1.0 / p.rate, self._on_frame)

    def close(self) -> None:
        """Show that the run has ended."""
        restarting = self._session is not None and self._session.next is not None
        self._note('restarting' if restarting else 'the run has ended')
        self._samples.close()
        self._page.attempts.add(self._run, self._traces)
        if self._closes_page:
            self._page.close()

    def _show_attempts(self) -> None:
        attempts = self._page.attempts
        self._traces.earlier = attempts.ghost
        rows = [(each.number, each.cells) for each in reversed(attempts.kept)]
        self._display.show_attempts(HEADS, rows, attempts.chosen, self._choose_ghost)

    def _choose_ghost(self, number: int) -> None:
        self._page.attempts.choose(number)
        self._show_attempts()

    # ---- parameters of the run ----

    def _on_control(self, control: Control) -> None:
        self._run.learn(control.tunable, control.value)
        self._panel.add(control)

    def _on_value(self, tunable: Tunable, value: Value) -> None:
        self._run.learn(tunable, value)
        if tunable.group:
            self._panel.show_value(tunable, value)
            self._keep(tunable, value)
        if tunable.node == 'simulator':
            self._scene.configure(self._run.of('simulator'))

    def _keep(self, tunable: Tunable, value: Value) -> None:
        if self._session is not None:
            self._session.keep(tunable.node, tunable.name, value)

    # ---- frames ----

    def _on_frame(self) -> None:
        self._count += 1
        self._display.act()
        self._client.send()
        if self._count % DISCOVER_EVERY == 1:
            self._client.discover()
            self._look_at_driver()
        if not self._display.readers:
            return
        self._look()
        if self._count % CHARTS_EVERY == 0:
            self._traces.swings = self._run.motion.swings
            self._traces.pushes = self._run.pushes
            self._display.show_traces(self._traces)
        if self._count % STATUS_EVERY == 0 and self._run.known:
            self._note(self._run.state_text(self._page.at_the_end if self._session else None))
        if self._restart_timer.due(self._run.over, time.monotonic()):
            self._at_the_end()

    def _look(self) -> None:
        fresh = False
        for topic, stamp_ns, numbers in self._samples.take():
            fresh = True
            balance = self._scene.take(topic, stamp_ns, numbers)
            now = self._run.now = stamp_ns / 1e9
            if balance is not None:
                stage = self._scene.signals.get(STAGE, ())
                self._traces.add(BALANCE, stamp_ns, balance)
                self._traces.add(CONSTANT, stamp_ns, self._run.constants(now, stage))
            if topic in polled_topics():
                self._traces.add(topic, stamp_ns, numbers)
        snapshot = self._scene.build() if fresh else None
        if snapshot is not None:
            self._display.show_scenes([snapshot])
        self._run.status.stage = int(self._scene.signals.get(STAGE, (0,))[0])

    def _look_at_driver(self) -> None:
        """Detect a driver that measures or supports less than the simulator."""
        if not self.count_publishers(JOINT_STATES.name):
            return
        self._scene.truth = self.count_publishers(TRUE_POSE.name) > 0
        self._scene.pushable = self.count_publishers(PUSHED.name) > 0
        self._panel.show_offers(self._client.pausable, self._scene.pushable)
        if not (self._scene.truth or self.count_publishers(ROBOT_DESCRIPTION.name)):
            self._reports.on_description(String(data=Robot.load().urdf))

    def _note(self, state: str) -> None:
        trouble = self._run.trouble or ('' if self._scene.truth else NO_TRUTH)
        run = self._run
        picture = heading(run.status.scenario, run.known_of_controllers(), run.now)
        rows = run.status.rows(run.now, run.over)
        self._display.show_status(Note(state, trouble, picture), rows)

    # ---- actions of the reader ----

    def change(self, tunable: Tunable, value: Value) -> None:
        """Request another value of a parameter."""
        if self._client.ask(tunable, value):
            self._run.learn(tunable, value)
            self._keep(tunable, value)

    def show_refusal(self, reason: str) -> None:
        """Show why an action was refused; an empty reason clears it."""
        self._run.trouble = reason

    def pause(self, halt: bool) -> None:
        """Pause or resume the run."""
        self._client.pause(halt)

    def at_the_end(self, action: EndAction) -> None:
        """Set the action that follows the end of a run."""
        self._page.at_the_end = action

    def restart(self) -> None:
        """End this run and start the same scenario again."""
        self._next(lambda session: session.restart())

    def switch(self, scenario: str) -> None:
        """End this run and start another scenario."""
        self._next(lambda session: session.switch(scenario))

    def _at_the_end(self) -> None:
        if self._page.at_the_end == 'same':
            self.restart()
        elif self._page.at_the_end == 'next':
            self._next(lambda session: session.next_seed())

    def _next(self, start: Callable[[Session], None]) -> None:
        if self._session is None or self._session.next is not None:
            return
        try:
            start(self._session)
        except KhrError as error:
            self._run.trouble = str(error)

    def push(self, force: tuple[float, float, float], done: bool) -> None:
        """Aim a push at the torso, N in odom; give it when ``done``."""
        if self._scene.pushable and done:
            self._publish_push(force)
        elif self._scene.pushable and self._scene.snapshot is not None:
            self._display.show_push(self._scene.snapshot, np.array(force))

    def _publish_push(self, force: tuple[float, float, float]) -> None:
        message = WrenchStamped()
        message.header.frame_id = WORLD
        vector = message.wrench.force
        vector.x, vector.y, vector.z = map(float, force)
        self._push.publish(message)
