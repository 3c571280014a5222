"""Timer of the simulator by the wall clock: one tick a period in realtime, or to keep a pace."""

from __future__ import annotations

import time
from collections.abc import Callable

from rclpy.timer import Timer

from khr_common.nodes.node import KhrNode
from khr_common.punctuality import Pace
from khr_sim.run_parameters import RunParameters

LOOKS = 4  # per control period whether its time has come, if there is a pace


class Metronome:
    """Tick each period in realtime mode, more often to keep a pace in lockstep, and else never.

    Args:
        node: that has the timer.
        on_tick: called at each tick.
    """

    def __init__(self, node: KhrNode, on_tick: Callable[[], None]) -> None:
        self._node, self._on_tick = node, on_tick
        self._timer: Timer | None = None
        self._tick = 0.0  # s of wall time; 0 is never
        self._paced = 0.0  # s of wall time that a period takes at least
        self._pace = Pace()

    def configure(self, parameters: RunParameters) -> None:
        """Take changed parameters."""
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
        """Return whether the pace, if there is one, lets the coming period begin."""
        return not self._paced or self._pace.begins(time.monotonic(), self._paced)
