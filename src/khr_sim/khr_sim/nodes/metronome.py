"""Wall-clock timer of the simulator: ticks once a period in realtime mode, or limits the pace."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.timer import Timer

from khr_common.nodes.node import KhrNode
from khr_common.pacing import Pace
from khr_sim.run_parameters import RunParameters

LOOKS = 4  # ticks per control period, if the pace is limited


class Metronome:
    """Tick once a period in realtime mode, more often with a limited pace, and otherwise never.

    Args:
        node: owner of the timer.
        on_tick: called at each tick.
    """

    def __init__(self, node: KhrNode, on_tick: Callable[[], None]) -> None:
        self._node, self._on_tick = node, on_tick
        self._timer: Timer | None = None
        self._tick = 0.0  # s of wall time; 0 is never
        self._paced = 0.0  # least wall time of a period, s
        self._pace = Pace()

    def configure(self, parameters: RunParameters) -> None:
        """Apply changed parameters."""
        p = parameters
        self._paced = p.control_period / p.pace if p.pace else 0.0
        factor = LOOKS * p.pace if p.sync == 'lockstep' else p.realtime_factor
        tick = p.control_period / factor if factor else 0.0
        if tick == self._tick:
            return
        if self._timer is not None:
            self._node.destroy_timer(self._timer)
        self._tick, self._timer = tick, None
        if tick:
            self._timer = self._node.by_wall_clock(tick, self._on_tick)

    def begins(self) -> bool:
        """Return whether the pace allows the next period to begin."""
        return not self._paced or self._pace.begins(time.monotonic(), self._paced)
