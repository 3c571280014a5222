"""The page node: it looks on at a graph, and shows it to whoever opens its address."""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rclpy.clock import Clock, ClockType
from std_msgs.msg import Float64MultiArray, String

from khr_bringup.scenario import find, shipped
from khr_bringup.strict_yaml import read_file
from khr_common.block import NodeSpec, Numbers
from khr_common.errors import KhrError
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
from khr_common.nodes.node import KhrNode
from khr_common.run_identity import check_status
from khr_sim.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view import events
from khr_view.controls import TUNABLES, WATCHED, Control, Tunable, Value
from khr_view.guard import SOCKET, TOKEN, inherited, open_door
from khr_view.nodes.remote import Remote
from khr_view.nodes.taps import Taps
from khr_view.page.display import Display, Note
from khr_view.page.live_panel import LivePanel
from khr_view.scenario_name import scenario_name
from khr_view.snapshot import NEEDED, Snapshot, SnapshotBuilder
from khr_view.spectrum_lines import NamedPeak, spectrum_lines
from khr_view.status import Status
from khr_view.traces import TOPICS, Traces

KEPT = 64  # messages of a topic between two pictures: 10 times real time at 30 pictures/s
CHARTS_EVERY, STATUS_EVERY = 3, 6  # pictures
LOOK_EVERY = 30  # pictures between looks for nodes that have appeared
PUSH_SHOWN = 0.5  # s of wall time
SILENCE = 5.0  # s of wall time without a report of the simulator: the run is gone


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
        self._display = Display(self._door)
        self._panel = LivePanel(
            self._display.server.gui, self._display.events.put, [path.stem for path in shipped()]
        )
        self._display.add_look()
        self._status, self._traces = Status(), Traces()
        self._signals: dict[Topic, Numbers] = {}
        self._robot: Robot | None = None
        self._builder: SnapshotBuilder | None = None
        self._known: dict[str, Any] = {}  # of what is watched, by name
        self._scene: Snapshot | None = None
        self._now = self._count = 0
        self._trouble = ''
        self._push_until = self._heard = 0.0
        self._tones: list[NamedPeak] = []
        self._taps = Taps(self, tuple(dict.fromkeys((*NEEDED, *TOPICS, STAGE))), KEPT)
        self._push = self.publisher(PUSH)
        for topic, callback in (
            (ROBOT_DESCRIPTION, self._on_description),
            (STATE, self._on_state),
            (DIAGNOSTICS, self._on_diagnostics),
            (SPECTRUM, self._on_spectrum),
            (PEAKS, self._on_peaks),
            (PUSHED, self._on_push),
        ):
            self.subscribe(topic, callback)
        self._remote = Remote(
            self, (*TUNABLES, *WATCHED), self._on_control, self._on_value, self._on_refusal
        )
        self.create_timer(
            1.0 / p.rate, self._on_frame, clock=Clock(clock_type=ClockType.STEADY_TIME)
        )
        if not handed:
            print(f'page: {self._door.address}', file=sys.stderr, flush=True)

    def close(self) -> None:
        """Show the readers that this is all, and stop serving."""
        self._note('the run is over')
        self._taps.close()
        self._display.close()

    # ---- what the graph says ----

    def _on_description(self, message: String) -> None:
        if self._robot is not None:
            return
        try:
            self._robot = Robot(message.data)
        except KhrError as error:
            self._trouble = str(error)
            return
        self._display.add_robot(self._robot)
        self._display.let_push()
        self._rebuild()

    def _on_state(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        check_status(values, self.run)
        if status.message == 'waiting' != self._status.state:
            self._remote.forget()
        self._heard = time.monotonic()
        self._status.state, self._trouble = status.message, values.get('reason', '')
        self._panel.show_paused(status.message == 'paused')

    def _on_diagnostics(self, array: DiagnosticArray) -> None:
        for status in array.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == 'monitor' and 'time' in values:
                self._status.monitor(status.message, values)
            elif status.name == 'simulator' and 'sync' in values:
                self._status.simulator(values)
                self._panel.show_sync(values['sync'])
                self._heard = time.monotonic()

    def _on_peaks(self, array: DiagnosticArray) -> None:
        self._tones = []
        for status in array.status:
            values = {pair.key: float(pair.value) for pair in status.values}
            self._tones.append(
                NamedPeak(status.name, values['frequency_hz'], values['amplitude_rad_s'])
            )

    def _on_spectrum(self, message: Float64MultiArray) -> None:
        if not self._display.readers:
            return
        lines = message.layout.dim[1].size
        frequency, amplitude = message.data[:lines], message.data[lines : 2 * lines]
        self._display.show_spectrum(
            spectrum_lines(frequency, amplitude, self._tones, self._known.get('fundamental', 0.0))
        )

    def _on_push(self, message: WrenchStamped) -> None:
        force = message.wrench.force
        if message.header.frame_id in ('', WORLD) and self._scene is not None:
            self._display.show_push(self._scene, np.array((force.x, force.y, force.z)))
            self._push_until = time.monotonic() + PUSH_SHOWN

    def _on_control(self, control: Control) -> None:
        self._panel.add(control)

    def _on_value(self, tunable: Tunable, value: Value) -> None:
        if tunable.group:
            self._panel.show_value(tunable, value)
            return
        if tunable.name == 'scenario_file' and value != self._known.get(tunable.name):
            self._show_scenario(Path(str(value)))
        self._known[tunable.name] = value
        self._rebuild()

    def _show_scenario(self, file: Path) -> None:
        """Name what runs after the file that the recorder has of it."""
        with suppress(KhrError):  # it may be on another machine
            self._status.scenario = scenario_name(file)
            self._panel.show_scenario(self._status.scenario)

    def _rebuild(self) -> None:
        own = {
            name: self._known[name] for name in ('surface', 'pad_distance') if name in self._known
        }
        if self._robot is not None:
            self._builder = SnapshotBuilder(self._robot, replace(RunParameters(), **own))

    def _on_refusal(self, reason: str) -> None:
        self._trouble = reason

    # ---- pictures ----

    def _on_frame(self) -> None:
        self._count += 1
        while not self._display.events.empty():
            self._take(self._display.events.get())
        self._remote.send()
        if self._count % LOOK_EVERY == 1:
            self._remote.discover()
        if not self._display.readers:
            return
        self._look()
        if self._count % CHARTS_EVERY == 0:
            self._display.show_traces(self._traces)
        if self._count % STATUS_EVERY == 0:
            self._note(self._state())
        if self._push_until and time.monotonic() > self._push_until and self._scene is not None:
            self._push_until = 0.0
            self._display.show_push(self._scene, np.zeros(3))

    def _look(self) -> None:
        traced = set(TOPICS)
        fresh = False
        for topic, stamp_ns, numbers in self._taps.take():
            fresh = True
            self._signals[topic], self._now = numbers, stamp_ns
            if topic in traced:
                self._traces.add(topic, stamp_ns, numbers)
        if fresh and self._builder and all(topic in self._signals for topic in NEEDED):
            self._scene = self._builder.build(self._signals)
            self._display.show_scenes([self._scene])
        self._status.stage = int(self._signals.get(STAGE, (0,))[0])

    def _state(self) -> str:
        silent = time.monotonic() - self._heard > SILENCE
        return 'no run' if silent and self._status.state != 'finished' else self._status.state

    def _note(self, state: str) -> None:
        self._display.show_status(Note(state, self._trouble), self._status.rows(self._now / 1e9))

    # ---- what the reader does ----

    def _take(self, event: Any) -> None:
        if isinstance(event, events.Changed):
            self._remote.ask(event.tunable, event.value)
        elif isinstance(event, events.Pause):
            self._remote.pause(event.halt)
        elif isinstance(event, events.Reset):
            self._remote.reset()
        elif isinstance(event, events.Switch):
            self._switch(event.scenario)
        elif isinstance(event, events.Pushed) and event.done:
            self._publish_push(event.force)
        elif isinstance(event, events.Pushed) and self._scene is not None:
            self._display.show_push(self._scene, np.array(event.force))

    def _switch(self, scenario: str) -> None:
        try:
            path = find(scenario)
            self._remote.switch(path.stem, read_file(path))
        except KhrError as error:
            self._trouble = str(error)

    def _publish_push(self, force: tuple[float, float, float]) -> None:
        message = WrenchStamped()
        message.header.frame_id = WORLD
        vector = message.wrench.force
        vector.x, vector.y, vector.z = map(float, force)
        self._push.publish(message)
