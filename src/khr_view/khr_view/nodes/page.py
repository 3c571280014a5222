"""The page node: it observes a graph and shows it in browsers."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial
from threading import Event

import numpy as np
from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.experimental.events_executor import EventsExecutor
from std_msgs.msg import String

from khr_analysis.referee import DRAW
from khr_common.block import NodeSpec
from khr_common.errors import KhrError, one_line
from khr_common.interfaces import DECISION, JOINT_STATES, PUSHED, ROBOT_DESCRIPTION, TRUE_POSE
from khr_common.nodes.node import KhrNode
from khr_common.statuses import KEY, check_run
from khr_description.robot import Robot
from khr_view.controls import Control, Tunable, Value, tunables_of
from khr_view.guard import listen
from khr_view.live_page import LivePage
from khr_view.model.live_run import HEADS
from khr_view.model.status import heading, side_by_side
from khr_view.nodes.run_client import RunClient
from khr_view.nodes.seen_robot import SeenRobot
from khr_view.parameters import PAGE
from khr_view.session import EndAction, RestartTimer, Session

CHARTS_EVERY, STATUS_EVERY = 3, 6  # frames
DISCOVER_EVERY = 30  # frames between checks for new nodes
NO_TRUTH = 'the driver does not know the pose: drawn upright, on level ground'


class PageNode(KhrNode):
    """Show the robots, signals and spectra of one run; pass on the reader's actions.

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
        self._restart_timer, self._count = RestartTimer(), 0
        self._client = RunClient(
            self, tunables_of(page.robots), self._on_control, self._on_value, self.show_refusal
        )
        self._robots = [
            SeenRobot(
                self, name, number, self._display, self._panel, self._client, self._add_robots
            )
            for number, name in enumerate(page.robots)
        ]
        self._run, self._scene, self._traces = (
            self._robots[0].run,
            self._robots[0].scene,
            self._robots[0].traces,
        )
        if self._session is not None:
            self._run.status.scenario = self._session.scenario.title
        self._decision = ''
        if len(self._robots) > 1:
            self.subscribe(DECISION, self._on_decision)
        self._display.restart()
        if len(self._robots) == 1:
            self._show_attempts()
        self._panel.begin(self, self._session.scenario if self._session else None)
        self.by_wall_clock(1.0 / p.rate, self._on_frame)

    def close(self) -> None:
        """Show that the run has ended."""
        restarting = self._session is not None and self._session.next is not None
        self._note('restarting' if restarting else 'the run has ended')
        for each in self._robots:
            each.close()
        if len(self._robots) == 1:
            self._page.attempts.add(self._run, self._traces)
        if self._closes_page:
            self._display.close()

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
        self._learn(control.tunable, control.value)
        self._panel.add(control)

    def _on_value(self, tunable: Tunable, value: Value) -> None:
        self._learn(tunable, value)
        if tunable.group:
            self._panel.show_value(tunable, value)
            self._keep(tunable, value)
        if tunable.node == 'simulator':
            for each in self._robots:
                each.scene.configure(each.run.of('simulator'))

    def _learn(self, tunable: Tunable, value: Value) -> None:
        for each in self._robots:
            if tunable.robot in ('', each.name):
                each.run.learn(tunable, value)

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
            for number, each in enumerate(self._robots):
                each.traces.swings = each.run.motion.swings
                each.traces.pushes = each.run.pushes
                self._display.show_traces(each.traces, number)
        if self._count % STATUS_EVERY == 0 and self._run.known:
            self._note(self._state_text)
        if self._restart_timer.due(self._run.over, time.monotonic()):
            self._at_the_end()

    def _look(self) -> None:
        if not any([each.look() for each in self._robots]) or not self._added:
            return
        scenes = [each.scene.build() for each in self._robots]
        if all(scenes):
            self._display.show_scenes(scenes, together=len(scenes) > 1)

    @property
    def _added(self) -> bool:
        return all(each.robot is not None for each in self._robots)

    def _add_robots(self) -> None:
        """Show the robots in their order, once all are described."""
        if not self._added:
            return
        for each in self._robots:
            assert each.robot is not None
            drag = partial(self.push, robot=each.name) if each.scene.pushable else None
            self._display.add_robot(each.robot, name=each.name, push=drag)

    @property
    def _state_text(self) -> str:
        """Return the state of the run; of a bout the decision of the referee, once it is there."""
        if len(self._robots) > 1:
            return self._decision or self._run.status.state
        return self._run.state_text(self._page.at_the_end if self._session else None)

    def _on_decision(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        check_run(values.get(KEY, ''), self.run)
        won = DRAW if status.message == DRAW else f'{status.message} wins'
        self._decision = one_line(f'{won}: {values.get("reason", "")}')

    def _look_at_driver(self) -> None:
        """Detect a driver that measures or supports less than the simulator."""
        for each in self._robots:
            if not self.publishers_of(JOINT_STATES.under(each.name)):
                return
            each.scene.truth = self.publishers_of(TRUE_POSE.under(each.name)) > 0
            each.scene.pushable = self.publishers_of(PUSHED.under(each.name)) > 0
        self._panel.show_offers(self._client.pausable, self._scene.pushable)
        if not (self._scene.truth or self.publishers_of(ROBOT_DESCRIPTION)):
            self._robots[0].on_description(String(data=Robot.load().urdf))

    def _note(self, state: str) -> None:
        trouble = self._run.trouble or ('' if self._scene.truth else NO_TRUTH)
        run = self._run
        picture = heading(run.status.scenario, run.known_of_controllers(), run.now)
        over = all(each.run.over for each in self._robots)
        rows = [dict(each.run.status.rows(each.run.now, over)) for each in self._robots]
        names = [('', *self._page.robots)] if len(rows) > 1 else []
        self._display.show_status(state, [*names, *side_by_side(rows)], trouble, picture)

    # ---- actions of the reader ----

    def change(self, tunable: Tunable, value: Value) -> None:
        """Request another value of a parameter."""
        if self._client.ask(tunable, value):
            self._learn(tunable, value)
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

    def push(self, force: tuple[float, float, float], done: bool, robot: str = '') -> None:
        """Aim a push at the torso of a robot, N in odom; give it when ``done``."""
        number = next(n for n, each in enumerate(self._robots) if robot in ('', each.name))
        pushed = self._robots[number]
        if pushed.scene.pushable and done:
            pushed.push(force)
        elif pushed.scene.pushable and pushed.scene.snapshot is not None:
            self._display.show_push(pushed.scene.snapshot, np.array(force), number=number)


def observe(page: LivePage, stop: Event) -> None:
    """Show the present run until ``stop`` is set; ROS is up meanwhile."""
    executor = EventsExecutor()
    node = PageNode(PAGE, page)
    executor.add_node(node)
    try:
        while not stop.is_set():
            executor.spin_once(0.05)
        node.close()
    finally:
        executor.shutdown()
        node.destroy_node()
