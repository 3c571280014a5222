"""Run states derived from the clock of a driver that does not publish them."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common import fixed
from khr_common.block import NodeSpec
from khr_common.interfaces import CLOCK, DIAGNOSTICS, STATE


@dataclass(frozen=True)
class RunPhaseParameters:
    """The parameter table of the node ``run_phase``."""

    duration: float = fixed(
        0.0,
        'Time of the run on the clock of the driver; 0 goes on until stopped (khr: as long as the '
        'motion).',
        '[0, 1e+06] s',
    )
    sync: str = fixed(
        'realtime',
        'Whether the driver waits for answers; the node only reports it.',
        choices=('lockstep', 'realtime'),
    )


RUN_PHASE = NodeSpec(
    'run_phase',
    'khr_analysis',
    RunPhaseParameters,
    subscribes=(CLOCK,),
    publishes=(STATE, DIAGNOSTICS),
    node='khr_analysis.nodes.run_phase:RunPhaseNode',
    joins=lambda _: False,  # only with a driver that does not report the state of its run
)


class RunPhase:
    """Follow the clock of a driver from state to state: waiting, running, finished.

    Attributes:
        state: of the run, in the words of the simulator.
        end: reason for the end of the run: duration, stopped; empty before the end.
        now_ns: last clock time before the end of the run, ns.
    """

    def __init__(self, parameters: RunPhaseParameters) -> None:
        self._end_ns = round(parameters.duration * 1e9) or None
        self.state, self.end, self.now_ns = 'waiting', '', 0

    def take(self, stamp_ns: int) -> bool:
        """Take a clock message; return whether it changes the state.

        A repeated timestamp, and timestamps after the end of the run, are ignored.
        """
        before = self.state
        if self.state == 'finished':
            return False
        self.now_ns = stamp_ns
        if self.state == 'waiting' and stamp_ns > 0:
            self.state = 'running'
        if self._end_ns is not None and stamp_ns >= self._end_ns:
            self.state, self.end = 'finished', 'duration'
        return self.state != before

    def stop(self) -> None:
        """End the run at the current clock time."""
        if self.state != 'finished':
            self.state, self.end = 'finished', 'stopped'
