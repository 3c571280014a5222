"""Where time begins for a node whose samples bear system time."""

from __future__ import annotations

from collections.abc import Callable

from khr_common import cdr
from khr_common.interfaces import CLOCK
from khr_common.nodes.node import KhrNode
from khr_common.stamps import StampJudge

SYSTEM_TIME = 10**17  # ns from which on a stamp is system time: no run lasts three years


class Epoch:
    """Count the time of a run: from 0 by simulated stamps, from the first one by system time.

    System time does not go back when a run begins anew, by which nodes notice that otherwise. So
    the clock of the driver is listened to as well, once such a stamp has come.

    Args:
        node: that receives the samples.
        restart: called when the clock goes back.
    """

    def __init__(self, node: KhrNode, restart: Callable[[], None]) -> None:
        self._node, self._restart = node, restart
        self._first: int | None = None
        self._clock: StampJudge | None = None

    def since(self, stamp_ns: int) -> int:
        """Return the time of a stamp in its run, ns."""
        if stamp_ns < SYSTEM_TIME:
            return stamp_ns
        if self._clock is None:
            self._clock = StampJudge(self._begin)
            self._node.subscribe_bytes(CLOCK, cdr.clock, self._on_clock)
        self._first = stamp_ns if self._first is None else self._first
        return stamp_ns - self._first

    def _on_clock(self, stamp_ns: int) -> None:
        if self._clock is not None:
            self._clock.is_new(stamp_ns)

    def _begin(self) -> None:
        self._first = None
        self._restart()
