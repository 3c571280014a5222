"""Reports of the graph, passed on to the page."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import Float64MultiArray, String

from khr_analysis.outcome import Outcome
from khr_bringup.changes import changes_in
from khr_bringup.recorded.events import Event, number, received_push
from khr_common.errors import KhrError
from khr_common.interfaces import (
    DIAGNOSTICS,
    PEAKS,
    PUSHED,
    ROBOT_DESCRIPTION,
    SPECTRUM,
    STATE,
    WORLD,
)
from khr_common.nodes.node import KhrNode
from khr_common.run_identity import MalformedError, check_status
from khr_common.status_values import real
from khr_common.text.quoting import one_line
from khr_description.robot import Robot
from khr_view.charts.charts import SLIP
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
from khr_view.model.live_scene import LiveScene
from khr_view.nodes.run_client import RunClient
from khr_view.page.display import Display
from khr_view.page.live_panel import LivePanel


class Reports:
    """Take the messages of the topics that are not periodic.

    Args:
        node: that subscribes.
        run, scene, traces: receive the reports.
        display, panel: show it.
        client: takes reported parameter changes.
        add: called with the robot once it is described.
        robot: its name in a bout.
        number: of the robot on the page, from 0.
    """

    def __init__(
        self,
        node: KhrNode,
        run: LiveRun,
        scene: LiveScene,
        traces: Traces,
        display: Display,
        panel: LivePanel,
        client: RunClient,
        add: Callable[[Robot], None],
        robot: str = '',
        number: int = 0,
    ) -> None:
        self._identity, self._add, self._number = node.run, add, number
        self._run, self._scene, self._traces = run, scene, traces
        self._display, self._panel, self._client = display, panel, client
        self._tones: list[PlacedPeak] = []
        self._bins: tuple[Array, Array] | None = None
        callbacks: dict[Any, Any] = {
            ROBOT_DESCRIPTION: self.on_description,
            STATE: self._on_state,
            DIAGNOSTICS: partial(self._on_diagnostics, robot),
            SPECTRUM: self._on_spectrum,
            PEAKS: self._on_peaks,
            PUSHED: self._on_push,
        }
        for topic, callback in callbacks.items():
            node.subscribe(topic.under(robot), callback)
        if robot:
            node.subscribe(DIAGNOSTICS, partial(self._on_diagnostics, ''))  # of the simulator

    def on_description(self, message: String) -> None:
        """Take the description of the robot; the first one counts."""
        try:
            robot = self._scene.describe(message.data)
        except KhrError as error:
            self._run.trouble = str(error)
            return
        if robot is None:
            return
        self._scene.configure(self._run.of('simulator'))
        self._add(robot)

    def _on_state(self, status: DiagnosticStatus) -> None:
        values = {pair.key: pair.value for pair in status.values}
        check_status(values, self._identity)
        self._run.reported = time.monotonic()
        self._run.status.state = one_line(status.message)
        self._run.trouble = one_line(values.get('reason', ''))
        self._panel.show_state(status.message)

    def _on_diagnostics(self, robot: str, array: DiagnosticArray) -> None:
        changes = changes_in([array])
        self._client.on_changes(changes, robot)
        self._traces.events += [
            Event(each.time, f'{each.node}.{each.parameter} = {number(each.value)}')
            for each in changes
        ]
        for status in array.status:
            values = {pair.key: pair.value for pair in status.values}
            if status.name == 'monitor' and 'time' in values:
                self._run.status.monitor(status.message, values)
                outcome = self._run.status.outcome
                if isinstance(outcome, Outcome):
                    fell = Event(outcome.fell_at, 'fell') if outcome.fell_at is not None else None
                    if fell and fell not in self._traces.events:
                        self._traces.events.append(fell)
                    stamp_ns = round(1e9 * real(values, 'time'))
                    self._traces.add(SLIP, stamp_ns, (outcome.slip_distance,))
            elif 'sync' in values:  # from the simulator or a driver
                self._run.status.simulator(values)
                self._panel.show_sync(values['sync'])
                self._run.reported = time.monotonic()

    def _on_peaks(self, array: DiagnosticArray) -> None:
        self._tones = peaks_in(array)
        self._show_spectrum()

    def _on_spectrum(self, message: Float64MultiArray) -> None:
        self._bins = bins_in(message)
        self._show_spectrum()

    def _show_spectrum(self) -> None:
        """Draw the spectrum once its bins and its peaks, which come in two messages, are there."""
        if self._bins and self._display.readers and belong_together(*self._bins, self._tones):
            lines = spectrum_lines(*self._bins, self._tones, self._run.motion.cycle)
            self._display.show_spectrum(lines, self._number)

    def _on_push(self, message: WrenchStamped) -> None:
        force = message.wrench.force
        if not isfinite(force.x + force.y + force.z):
            raise MalformedError('numbers that are not finite')
        self._traces.events.append(received_push(message))
        if message.header.frame_id in ('', WORLD) and self._scene.snapshot is not None:
            acting = np.array((force.x, force.y, force.z))
            self._display.show_push(self._scene.snapshot, acting, acts=True, number=self._number)
