"""Lockstep: the nodes that a run waits for, republication of samples, and timeouts."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

Answer = TypeVar('Answer')

ASK_AGAIN = 0.1  # s of wall time without an answer, before a sample is published again
LEAD = 3_000_000_000  # ns of simulated time; a run may be ahead of a listener by this much
KEPT = 200  # samples; taken answers are kept this long to detect contradictions
SILENCE = 4.0  # s of wall time without a report of a listener that lacks the end of the run


class Barrier(Generic[Answer]):
    """Buffer the answers to the samples of one run until the simulator takes them.

    The first answer of a source to a sample counts; later ones are ignored. An answer ahead
    of the newest sample is rejected.

    Attributes:
        newest: the last answer of each source, whatever its timestamp.
        now_ns: timestamp of the newest sample.
    """

    def __init__(self, sources: Sequence[str]) -> None:
        self._sources = tuple(sources)
        # by timestamp of samples not yet taken, and of those taken, oldest first
        self._answers: dict[int, dict[str, Answer]] = {}
        self._taken: dict[int, dict[str, Answer]] = {}
        self.newest: dict[str, Answer] = {}
        self.now_ns = -1

    def open(self, stamp_ns: int) -> None:
        """Accept answers to the sample at ``stamp_ns``; of older samples keep only the last one."""
        self._answers = {
            stamp: answers for stamp, answers in self._answers.items() if stamp == self.now_ns
        } | {stamp_ns: {}}
        self.now_ns = stamp_ns

    def put(self, source: str, stamp_ns: int, answer: Answer) -> bool:
        """Buffer an answer; return whether its sample still waits for answers."""
        if stamp_ns > self.now_ns:
            return False
        self.newest[source] = answer
        if stamp_ns not in self._answers:
            return False
        self._answers[stamp_ns].setdefault(source, answer)
        return True

    def first(self, source: str, stamp_ns: int) -> Answer | None:
        """Return the first answer of a source to a sample; None if missing or no longer kept."""
        answers = self._answers.get(stamp_ns) or self._taken.get(stamp_ns, {})
        return answers.get(source)

    @property
    def asked_ns(self) -> int:
        """Timestamp of the oldest sample with answers not yet taken; by default of the newest."""
        return next(iter(self._answers), self.now_ns)

    def given(self) -> dict[str, Answer]:
        """Return the answers to the oldest open sample, by source."""
        return self._answers.get(self.asked_ns, {})

    def missing(self) -> list[str]:
        """List the sources without an answer to the oldest open sample."""
        given = self.given()
        return [source for source in self._sources if self._answers and source not in given]

    def take(self) -> dict[str, Answer] | None:
        """Take the answers to the oldest open sample, once; None if any is missing."""
        stamp_ns = self.asked_ns
        if self.missing() or stamp_ns not in self._answers:
            return None
        self._taken[stamp_ns] = self._answers.pop(stamp_ns)
        if len(self._taken) > KEPT:
            del self._taken[next(iter(self._taken))]
        return self._taken[stamp_ns]


class Receipts:
    """Record up to which timestamp each listener has received the run, in ns."""

    def __init__(self, listeners: Sequence[str]) -> None:
        self._listeners = [name for name in listeners if name]
        self._up_to: dict[str, int] = {}

    def take(self, name: str, stamp_ns: int, now_ns: int) -> bool:
        """Store a report; return False for unknown listeners and for samples not yet published."""
        wanted = name in self._listeners and stamp_ns <= now_ns
        if wanted:
            self._up_to[name] = stamp_ns
        return wanted

    def absent(self) -> list[str]:
        """List the listeners that have never reported."""
        return [name for name in self._listeners if name not in self._up_to]

    def behind(self, stamp_ns: int) -> dict[str, int]:
        """Return the listeners that lack samples up to a timestamp, with their last timestamp."""
        found = {name: self._up_to.get(name, 0) for name in self._listeners}
        return {name: up_to for name, up_to in found.items() if up_to < stamp_ns}


class Lockstep(Generic[Answer]):
    """Decide whether a run may go on, must wait, or has timed out.

    Args:
        sources: names of the nodes that answer each sample.
        listeners: names of the nodes that must receive all samples.
        clock: wall clock, s.

    Attributes:
        barrier: answers of this run.
        receipts: progress of each listener.
    """

    def __init__(
        self,
        sources: Sequence[str],
        listeners: Sequence[str],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._sources, self._clock = sources, clock
        self.receipts = Receipts(listeners)
        self.barrier: Barrier[Answer] = Barrier(self._sources)
        self.barrier.open(0)
        self._born = self._reported = self._clock()

    def reported(self) -> None:
        """Restart the timeout: the run has advanced, or a listener has reported."""
        self._reported = self._clock()

    def absent(self) -> list[str]:
        """List the nodes that the start of the run waits for."""
        return self.barrier.missing() + self.receipts.absent()

    def missing(self, ready: bool) -> list[str]:
        """List the nodes that the next period waits for.

        Args:
            ready: whether the answers that act in the period have been taken.
        """
        return [*([] if ready else self.barrier.missing()), *self._behind()]

    def asks(self) -> bool:
        """Return whether to publish the sample again."""
        return self._silent > ASK_AGAIN

    def late(self, limit: float, ready: bool) -> str:
        """Return the reason for a timeout after ``limit`` s of wall time; empty before."""
        if self._silent <= limit:
            return ''
        if ready:
            reason = 'not received whole by ' + ', '.join(
                f'{name} after t = {up_to / 1e9:.3f} s' for name, up_to in self._behind().items()
            )
        else:
            silent, stamp = ', '.join(self.barrier.missing()), self.barrier.asked_ns / 1e9
            reason = f'no answer from {silent} for t = {stamp:.3f} s'
        return f'{reason} within {limit:g} s of wall time'

    def never_started(self, limit: float) -> str:
        """Return the reason for a start timeout after ``limit`` s, or empty; 0 waits forever."""
        if not limit or self._clock() - self._born <= limit:
            return ''
        return f'{", ".join(self.absent())} did not appear within {limit:g} s'

    def received(self) -> bool:
        """Return whether all listeners have the whole run, or have timed out."""
        return not self.receipts.behind(self.barrier.now_ns) or self._silent > SILENCE

    @property
    def _silent(self) -> float:
        return self._clock() - self._reported

    def _behind(self) -> dict[str, int]:
        return self.receipts.behind(self.barrier.now_ns - LEAD)
