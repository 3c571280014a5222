"""What belongs to one instant, put together by stamp."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

Name = TypeVar('Name')
HISTORY = 500  # messages that the middleware keeps of a topic for a listener that is behind


class StampJudge:
    """Distinguish new stamps from repeated ones and from those of a restarted run.

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


class ExactTimeSynchronizer(Generic[Name]):
    """Gather the messages of several topics until all of one stamp are there.

    Each topic arrives whole and in order, but none waits for another: what the middleware has to
    send again can be hundreds of instants behind the rest. So whatever is begun is kept until it
    is complete, and instants are complete in their order.

    Args:
        names: of the topics of which an instant needs a message.

    Attributes:
        rewinds: how often a topic went back in time, as all do when a run starts anew.
    """

    def __init__(self, names: Sequence[Name]) -> None:
        self._names = tuple(names)
        self.rewinds = 0
        self._newest: dict[Name, int] = {}
        self._values: dict[int, dict[Name, Any]] = {}  # by stamp, the newest at the end

    def put(self, name: Name, stamp_ns: int, value: Any) -> dict[Name, Any] | None:
        """Take one message; return all of its instant by name once those needed are there."""
        if stamp_ns < self._newest.get(name, stamp_ns):
            self.rewinds += 1
            self._forget(name)
        self._newest[name] = stamp_ns
        values = self._values.setdefault(stamp_ns, {})
        values[name] = value
        if self._complete(values):
            # What is older is an incomplete repeat, or from before we subscribed.
            self._values = {
                stamp: begun for stamp, begun in self._values.items() if stamp > stamp_ns
            }
            return values
        if len(self._values) > HISTORY:
            del self._values[next(iter(self._values))]
        return None

    def require(self, names: Sequence[Name]) -> list[tuple[int, dict[Name, Any]]]:
        """Need other topics from now on; return the instants that are complete with these."""
        self._names = tuple(names)
        complete = sorted(
            (stamp, begun) for stamp, begun in self._values.items() if self._complete(begun)
        )
        for stamp, _ in complete:
            del self._values[stamp]
        return complete

    def _complete(self, values: dict[Name, Any]) -> bool:
        # The lengths say so at once of most: only the last signal of an instant makes it complete.
        return len(values) >= len(self._names) and all(name in values for name in self._names)

    def _forget(self, name: Name) -> None:
        """Drop what a topic sent in the run before: it has begun another."""
        for values in self._values.values():
            values.pop(name, None)
