"""What belongs to one instant, put together by stamp."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

HISTORY = 500  # messages that the middleware keeps of a topic for a listener that is behind


class StampJudge:
    """Tell a new stamp from a repeated one and from a restarted run.

    A simulator that misses an answer asks again with the same stamp: a node then sends its last
    answer once more and its core does not step. A stamp that goes back is a run that starts anew.

    Attributes:
        last: the newest stamp of the run, ns; negative before the first.
    """

    def __init__(self, restart: Callable[[], None]) -> None:
        self.last = -1
        self._restart = restart

    def is_new(self, stamp_ns: int) -> bool:
        """Return whether the core should step; restart it first if time went back."""
        if stamp_ns == self.last:
            return False
        if stamp_ns < self.last:
            self._restart()
        self.last = stamp_ns
        return True


class StampedSet:
    """Gather messages of several topics until all of one stamp are there.

    Each topic comes whole and in order, but none waits for another: what the middleware has to
    send again can be hundreds of instants behind the rest. So whatever is begun is kept until it
    is complete, and instants are complete in their order.
    """

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names
        self._newest: dict[str, int] = {}
        self._values: dict[int, dict[str, Any]] = {}  # by stamp, the one begun last at the end

    def put(self, name: str, stamp_ns: int, value: Any) -> list[Any] | None:
        """Take one message; return all in the order of the names once they are complete."""
        if stamp_ns < self._newest.get(name, stamp_ns):
            self._forget(name)
        self._newest[name] = stamp_ns
        values = self._values.setdefault(stamp_ns, {})
        values[name] = value
        if len(values) == len(self._names):
            # What is older can only be half of an instant told twice, or from before we listened.
            self._values = {
                stamp: begun for stamp, begun in self._values.items() if stamp > stamp_ns
            }
            return [values[each] for each in self._names]
        if len(self._values) > HISTORY:
            del self._values[next(iter(self._values))]
        return None

    def _forget(self, name: str) -> None:
        """Drop what a topic told of the run before: it has begun another."""
        for values in self._values.values():
            values.pop(name, None)
