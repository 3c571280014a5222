"""The run on show, as far as the graph has reported it, and the attempts before it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, inf, nan
from typing import Any

from khr_analysis.outcome import Outcome
from khr_bringup.node_registry import controllers, table_of
from khr_bringup.recorded.events import Event, timed_pushes
from khr_bringup.recorded.run_signals import constant_part
from khr_common import build, specifications
from khr_sim.run_parameters import GAIT
from khr_view.charts.traces import Ghost, Traces
from khr_view.controls import Tunable, Value
from khr_view.model.status import (
    NO_RUN,
    GaitMotion,
    Status,
    gains_text,
    motion_in,
    over,
    state_text,
)

SILENCE = 5.0  # s of wall time without a report of the simulator: the run is gone
MOST = 12  # that are kept
HEADS = ('', 'gains', 'slope', 'verdict', 'slip, mm', 'vibration, deg/s')


class LiveRun:
    """Keep the reported state of the run.

    Attributes:
        status: that the graph reports.
        now: simulated time of the newest sample, s.
        reported: wall time of the simulator's last report, s.
        trouble: an error for the reader; empty without one.
    """

    def __init__(self) -> None:
        self.status = Status(factor=nan)
        self.now, self.reported = 0.0, time.monotonic()
        self.trouble = ''
        self._motion: GaitMotion | None = None  # computed on first use
        self._known: dict[tuple[str, str], Value | str] = {}
        self._tables: dict[str, Any] = {}  # of the controllers, built on first use

    def learn(self, tunable: Tunable, value: Any) -> None:
        """Take the value that a parameter has."""
        self._known[tunable.node, tunable.name] = value
        self._tables.pop(tunable.node, None)
        if tunable.node == GAIT:
            self._motion = None

    def of(self, node: str) -> dict[str, Any]:
        """Return the known parameters of a node."""
        return {name: value for (each, name), value in self._known.items() if each == node}

    def known_of_controllers(self) -> dict[str, dict[str, Any]]:
        """Return the known parameters of all controllers."""
        return {node: self.of(node) for node in controllers()}

    def constants(self, time: float, stage: Sequence[float] = ()) -> tuple[float, ...]:
        """Return the constant part of each controller's correction, rad, at a time in s."""
        return tuple(constant_part(node, self._table(node), time, stage) for node in controllers())

    def _table(self, node: str) -> Any:
        if node not in self._tables:
            table = table_of(node)
            known = {
                name: value
                for name, value in self.of(node).items()
                if name in specifications(table)
            }
            self._tables[node] = build(table, known) if known else None
        return self._tables[node]

    @property
    def motion(self) -> GaitMotion:
        """Return the motion of the gait."""
        if self._motion is None:
            self._motion = motion_in(self.of(GAIT))
        return self._motion

    @property
    def pushes(self) -> list[Event]:
        """Return the pushes that the scenario times."""
        return timed_pushes(self.of('simulator').get('pushes', ()))

    @property
    def over(self) -> bool:
        """Return whether the robot fell or its motion has ended."""
        return over(self._seen, self.motion, self.now)

    def state_text(self, at_the_end: str | None) -> str:
        """Describe the state; ``at_the_end`` is the action that follows the end of the run."""
        return state_text(self._seen, self.motion, self.now, at_the_end)

    @property
    def known(self) -> bool:
        """Return whether there is a state to show: a reported one, or a long silence."""
        return self.status.state != NO_RUN or self._silent

    @property
    def _silent(self) -> bool:
        return time.monotonic() - self.reported > SILENCE

    @property
    def _seen(self) -> Status:
        """Return the status, without a run if its simulator has been silent for too long."""
        if self._silent and self.status.state != 'finished':
            return replace(self.status, state=NO_RUN)
        return self.status


@dataclass(frozen=True)
class Attempt:
    """A finished run of the page."""

    number: int  # from 1
    cells: tuple[str, ...]  # text of each column but the first
    ghost: Ghost  # its signals


class Attempts:
    """Keep the last attempts.

    Attributes:
        kept: oldest first.
        chosen: number of the attempt shown as a ghost; 0 for none.
    """

    def __init__(self) -> None:
        self.kept: list[Attempt] = []
        self.chosen = 0

    @property
    def ghost(self) -> Ghost:
        """Return the signals of the chosen attempt."""
        return next((each.ghost for each in self.kept if each.number == self.chosen), {})

    def add(self, run: LiveRun, traces: Traces) -> None:
        """Keep a run that has ended; a run that nobody looked at is not kept.

        It becomes the ghost if the attempt before it was the ghost; a ghost chosen by the reader
        stays.
        """
        outcome = run.status.outcome
        if not isinstance(outcome, Outcome):
            return
        latest = self.kept[-1].number if self.kept else 0
        number = latest + 1
        cut = not outcome.fell and run.now < run.motion.end < inf
        slope = run.of('simulator').get('inclination_deg')
        cells = (
            gains_text(run.known_of_controllers()),
            f'{slope:.4g}°' if slope is not None else '',
            outcome.verdict + ' so far' * cut,
            f'{1e3 * outcome.slip_distance:.1f}',
            f'{degrees(outcome.vibration):.1f}',
        )
        self.kept = [*self.kept, Attempt(number, cells, traces.as_ghost())][-MOST:]
        if self.chosen == latest:
            self.chosen = number

    def choose(self, number: int) -> None:
        """Choose the ghost; the attempt chosen before is no longer shown."""
        self.chosen = 0 if number == self.chosen else number
