"""The page node: it looks on at a graph, and shows it to whoever opens its address."""

from __future__ import annotations

import os
import sys
import time
from functools import partial

import numpy as np
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import String

from khr_bringup.scenario.scenario import find_scenario, shipped
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
from khr_common.text.strict_yaml import read_file
from khr_sim.robot import Robot
from khr_view.charts.charts import charts, tapped
from khr_view.charts.traces import Traces
from khr_view.controls import WATCHED, Tunable, Value, tunables
from khr_view.guard import SOCKET, TOKEN, inherited, open_door
from khr_view.model.again import Again, How
from khr_view.model.live_run import LiveRun
from khr_view.model.live_scene import LiveScene
from khr_view.model.snapshot import NEEDED
from khr_view.nodes.remote import Remote
from khr_view.nodes.reports import Reports
from khr_view.nodes.taps import Taps
from khr_view.page.display import Display, Note
from khr_view.page.live_panel import LivePanel

KEPT = 64  # messages of a topic between two pictures: 10 times real time at 30 pictures/s
CHARTS_EVERY, STATUS_EVERY = 3, 6  # pictures
LOOK_EVERY = 30  # pictures between looks for nodes that have appeared
NO_TRUTH = 'the driver does not know the pose: drawn upright, on level ground'


class PageNode(KhrNode):
    """Show the robot, its signals and its spectrum; pass on what the reader changes."""

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        p = self.parameters
        handed = os.environ.get(SOCKET)
        self._door = (
            inherited(int(handed), p.host, os.environ.get(TOKEN, ''))
            if handed
            else open_door(p.host, p.port)
        )
        display = self._display = Display(self._door, charts())
        scenarios = [path.stem for path in shipped()]
        self._panel = LivePanel(display.server, display.later, self, scenarios, p.again)
        display.add_look()
        self._run, self._again = LiveRun(), Again(p.again)
        self._scene, self._traces = LiveScene(), Traces()
        self._count = 0
        self._taps = Taps(self, tuple(dict.fromkeys((*NEEDED, *tapped(), STAGE))), KEPT)
        self._push = self.publisher(PUSH)
        refused = partial(setattr, self._run, 'trouble')
        self._remote = Remote(
            self, (*tunables(), *WATCHED), self._panel.add, self._on_value, refused
        )
        self._reports = Reports(
            self,
            self._run,
            self._scene,
            self._traces,
            display,
            self._panel,
            self._remote,
            self.push,
        )
        self.by_wall_clock(1.0 / p.rate, self._on_frame)
        if not handed:
            print(f'page: {self._door.address}', file=sys.stderr, flush=True)

    def close(self) -> None:
        """Show the readers that this is all, and stop serving."""
        self._note('the run has ended')
        self._taps.close()
        self._display.close()

    # ---- parameters of the run ----

    def _on_value(self, tunable: Tunable, value: Value) -> None:
        before = self._run.status.scenario
        self._run.learn(tunable, value)
        if tunable.group:
            self._panel.show_value(tunable, value)
        elif self._run.status.scenario != before:
            self._panel.show_scenario(self._run.status.scenario)
        elif tunable.node == 'simulator':
            self._scene.configure(self._run.of('simulator'))

    # ---- pictures ----

    def _on_frame(self) -> None:
        self._count += 1
        self._display.act()
        self._remote.send()
        if self._count % LOOK_EVERY == 1:
            self._remote.discover()
            self._look_at_driver()
        if not self._display.readers:
            return
        self._look()
        if self._count % CHARTS_EVERY == 0:
            self._display.show_traces(self._traces)
        if self._count % STATUS_EVERY == 0 and self._run.known:
            self._note(self._run.in_words(self._again.how))
        if self._again.due(self._run.over, time.monotonic()):
            self._begin_again()

    def _look(self) -> None:
        fresh = False
        for topic, stamp_ns, numbers in self._taps.take():
            fresh = True
            self._scene.take(topic, stamp_ns, numbers)
            self._run.now = stamp_ns / 1e9
            if topic in tapped():
                self._traces.add(topic, stamp_ns, numbers)
        snapshot = self._scene.build() if fresh else None
        if snapshot is not None:
            self._display.show_scenes([snapshot])
        self._run.status.stage = int(self._scene.signals.get(STAGE, (0,))[0])

    def _look_at_driver(self) -> None:
        """Notice a driver that knows or offers less than the simulator."""
        if not self.count_publishers(JOINT_STATES.name):
            return
        self._scene.truth = self.count_publishers(TRUE_POSE.name) > 0
        self._scene.pushable = self.count_publishers(PUSHED.name) > 0
        self._panel.show_offers(*self._remote.offers(), self._scene.pushable)
        if not (self._scene.truth or self.count_publishers(ROBOT_DESCRIPTION.name)):
            self._reports.on_description(String(data=Robot.load().urdf))

    def _note(self, state: str) -> None:
        trouble = self._run.trouble or ('' if self._scene.truth else NO_TRUTH)
        self._display.show_status(Note(state, trouble), self._run.status.rows(self._run.now))

    # ---- what the reader does ----

    def change(self, tunable: Tunable, value: Value) -> None:
        """Give a parameter another value."""
        self._run.learn(tunable, value)
        self._remote.ask(tunable, value)

    def pause(self, halt: bool) -> None:
        """Halt time, or let it go on."""
        self._remote.pause(halt)

    def reset(self) -> None:
        """Start the run anew."""
        self._remote.reset()

    def repeat(self, how: How) -> None:
        """Say how a run that is over begins again."""
        self._again.how = how

    def push(self, force: tuple[float, float, float], done: bool) -> None:
        """Aim a push at the torso, N in odom; give it when ``done``."""
        if self._scene.pushable and done:
            self._publish_push(force)
        elif self._scene.pushable and self._scene.snapshot is not None:
            self._display.show_push(self._scene.snapshot, np.array(force))

    def switch(self, scenario: str) -> None:
        """Put another scenario in the place of the one that runs."""
        try:
            path = find_scenario(scenario)
            self._remote.switch(path.stem, read_file(path))
        except KhrError as error:
            self._run.trouble = str(error)

    def _begin_again(self) -> None:
        if self._again.how == 'same':
            self._remote.reset()
            return
        try:
            self._remote.switch(self._run.status.scenario, self._run.with_next_seed())
        except KhrError as error:
            self._run.trouble = str(error)

    def _publish_push(self, force: tuple[float, float, float]) -> None:
        message = WrenchStamped()
        message.header.frame_id = WORLD
        vector = message.wrench.force
        vector.x, vector.y, vector.z = map(float, force)
        self._push.publish(message)
