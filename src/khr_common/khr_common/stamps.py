"""Stamps of samples: repeated ones, and samples of several topics joined by stamp."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Generic, TypeVar

from khr_common.errors import KhrError

Name = TypeVar('Name')
HISTORY = 500  # messages of a topic that the middleware keeps for a slow subscriber
SYSTEM_TIME = 10**17  # ns: later stamps are system time, since no run lasts three years


class TimeJumpError(KhrError):
    """A stamp that goes back: a clock has been restarted, which no run survives."""

    def __init__(self, before_ns: int, after_ns: int) -> None:
        super().__init__(f'time went back from {before_ns / 1e9:.3f} s to {after_ns / 1e9:.3f} s')


class StampSequence:
    """Distinguish new stamps from repeated ones.

    A simulator that misses an answer publishes the same sample again: a node then sends its last
    answer again, and its core does not step.

    Attributes:
        last: the newest stamp, ns; negative before the first.
    """

    def __init__(self) -> None:
        self.last = -1

    def is_new(self, stamp_ns: int) -> bool:
        """Take a stamp; return whether it is new.

        Raises:
            TimeJumpError: if it is older than the last.
        """
        if stamp_ns < self.last:
            raise TimeJumpError(self.last, stamp_ns)
        new = stamp_ns > self.last
        self.last = stamp_ns
        return new


class RunTime:
    """Convert stamps to the time of the run: system time counts from its first stamp."""

    def __init__(self) -> None:
        self._first = 0

    def since_start(self, stamp_ns: int) -> int:
        """Return the time of a stamp since the start of the run, ns."""
        if stamp_ns < SYSTEM_TIME:
            return stamp_ns
        if not self._first:
            self._first = stamp_ns
        return stamp_ns - self._first


class ExactTimeSynchronizer(Generic[Name]):
    """Join the messages of several topics by stamp.

    Each topic arrives complete and in order, but topics do not wait for one another: messages that
    the middleware sends again can be hundreds of samples late. Incomplete samples are therefore
    kept, and samples become complete in their order.

    Args:
        names: of the topics that a complete sample needs.
    """

    def __init__(self, names: Sequence[Name]) -> None:
        self._names = tuple(names)
        self._newest: dict[Name, int] = {}
        self._values: dict[int, dict[Name, Any]] = {}  # by stamp, the newest at the end

    def put(self, name: Name, stamp_ns: int, value: Any) -> dict[Name, Any] | None:
        """Take one message; return all messages of its stamp once the sample is complete.

        Raises:
            TimeJumpError: if the topic goes back in time.
        """
        newest = self._newest.get(name, stamp_ns)
        if stamp_ns < newest:
            raise TimeJumpError(newest, stamp_ns)
        self._newest[name] = stamp_ns
        values = self._values.setdefault(stamp_ns, {})
        values[name] = value
        if self._complete(values):
            # Older samples are incomplete repetitions, or were sent before we subscribed.
            self._values = {
                stamp: begun for stamp, begun in self._values.items() if stamp > stamp_ns
            }
            return values
        if len(self._values) > HISTORY:
            del self._values[next(iter(self._values))]
        return None

    def require(self, names: Sequence[Name]) -> list[tuple[int, dict[Name, Any]]]:
        """Need other topics from now on; return the samples that are complete with these."""
        self._names = tuple(names)
        complete = sorted(
            (stamp, begun) for stamp, begun in self._values.items() if self._complete(begun)
        )
        for stamp, _ in complete:
            del self._values[stamp]
        return complete

    def _complete(self, values: dict[Name, Any]) -> bool:
        # The lengths differ until the last message of a sample: a cheap test first.
        return len(values) >= len(self._names) and all(name in values for name in self._names)
