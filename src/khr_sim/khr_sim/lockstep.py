"""Lockstep: for whom a run waits, when it asks again, and when it gives up."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

Answer = TypeVar('Answer')

ASK_AGAIN = 0.1  # s of wall time without an answer
LEAD = 3_000_000_000  # ns of simulated time that a run may be ahead of a listener
KEPT = 200  # instants whose answers are known after they have been taken
SILENCE = 4.0  # s of wall time without a report of those that have not received the end


class Barrier(Generic[Answer]):
    """Hold the answers to the instants of one run until they are taken.

    The first answer of a source to an instant counts; a second one changes nothing. An answer to
    an instant that has not been yet is one of an earlier run, and is refused.
    """

    def __init__(self, sources: Sequence[str]) -> None:
        self._sources = tuple(sources)
        self._answers: dict[
            int, dict[str, Answer]
        ] = {}  # to the instants not taken, the oldest first
        self._newest: dict[str, Answer] = {}
        self._taken: dict[int, dict[str, Answer]] = {}  # likewise
        self.now_ns = -1

    def open(self, stamp_ns: int) -> None:
        """Begin to take answers to the instant ``stamp_ns``; forget all but the one before."""
        self._answers = {
            stamp: answers for stamp, answers in self._answers.items() if stamp == self.now_ns
        } | {stamp_ns: {}}
        self.now_ns = stamp_ns

    def put(self, source: str, stamp_ns: int, answer: Answer) -> bool:
        """Hold an answer; return whether it is one that was asked for."""
        if stamp_ns > self.now_ns:
            return False
        self._newest[source] = answer
        if stamp_ns not in self._answers:
            return False
        self._answers[stamp_ns].setdefault(source, answer)
        return True

    def first(self, source: str, stamp_ns: int) -> Answer | None:
        """Return the answer of a source that counts for an instant, if it came not long ago."""
        answers = self._answers.get(stamp_ns) or self._taken.get(stamp_ns, {})
        return answers.get(source)

    @property
    def asked_ns(self) -> int:
        """The oldest instant whose answers have not been taken; the newest if all have been."""
        return next(iter(self._answers), self.now_ns)

    def given(self) -> dict[str, Answer]:
        """Return the answers to the instant that is asked for, by source."""
        return self._answers.get(self.asked_ns, {})

    def missing(self) -> list[str]:
        """List the sources that have not answered to the instant that is asked for."""
        given = self.given()
        return [source for source in self._sources if self._answers and source not in given]

    def take(self) -> dict[str, Answer] | None:
        """Take the answers to the instant that is asked for, once; None unless all are there."""
        instant = self.asked_ns
        if self.missing() or instant not in self._answers:
            return None
        self._taken[instant] = self._answers.pop(instant)
        if len(self._taken) > KEPT:
            del self._taken[next(iter(self._taken))]
        return self._taken[instant]

    def newest(self) -> dict[str, Answer]:
        """Return the last answer of each source, to whatever instant."""
        return self._newest


class Receipts:
    """Up to when each listener has received a run, ns; one that has never reported is absent."""

    def __init__(self, listeners: Sequence[str]) -> None:
        self._listeners = [name for name in listeners if name]
        self._up_to: dict[str, int] = {}

    def take(self, name: str, stamp_ns: int, now_ns: int) -> bool:
        """Take a report; return whether it comes from a listener, about a sample already sent."""
        wanted = name in self._listeners and stamp_ns <= now_ns
        if wanted:
            self._up_to[name] = stamp_ns
        return wanted

    def absent(self) -> list[str]:
        """List the listeners that have never reported."""
        return [name for name in self._listeners if name not in self._up_to]

    def behind(self, instant_ns: int) -> dict[str, int]:
        """Return the listeners that have not received up to an instant, and how far they have."""
        found = {name: self._up_to.get(name, 0) for name in self._listeners}
        return {name: up_to for name, up_to in found.items() if up_to < instant_ns}


class Lockstep(Generic[Answer]):
    """What the runs of a simulator wait for, and for how long by the wall clock.

    Args:
        sources: names of those that answer every instant.
        listeners: names of those that must receive all of a run.
        clock: of the wall, in s.

    Attributes:
        barrier: the answers of this run.
        receipts: how far each listener has received it.
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
        """Count the silence from now on: the run went on, or a listener has reported."""
        self._reported = self._clock()

    def absent(self) -> list[str]:
        """List those without whom the run does not start."""
        return self.barrier.missing() + self.receipts.absent()

    def missing(self, ready: bool) -> list[str]:
        """List those for whom the coming period waits.

        Args:
            ready: whether the answers that act in it have been taken.
        """
        return [*([] if ready else self.barrier.missing()), *self._behind()]

    def asks(self) -> bool:
        """Return whether it is time to ask again."""
        return self._silent > ASK_AGAIN

    def late(self, limit: float, ready: bool) -> str:
        """Return why a run that has waited ``limit`` s cannot go on; empty while it may."""
        if self._silent <= limit:
            return ''
        if ready:
            reason = 'not received whole by ' + ', '.join(
                f'{name} after t = {up_to / 1e9:.3f} s' for name, up_to in self._behind().items()
            )
        else:
            silent, instant = ', '.join(self.barrier.missing()), self.barrier.asked_ns / 1e9
            reason = f'no answer from {silent} for t = {instant:.3f} s'
        return f'{reason} within {limit:g} s of wall time'

    def never_started(self, limit: float) -> str:
        """Return why a run that does not start within ``limit`` s cannot; 0 waits for ever."""
        if not limit or self._clock() - self._born <= limit:
            return ''
        return f'{", ".join(self.absent())} did not appear within {limit:g} s'

    def received(self) -> bool:
        """Return whether the listeners have all of the run, or have fallen silent."""
        return not self.receipts.behind(self.barrier.now_ns) or self._silent > SILENCE

    @property
    def _silent(self) -> float:
        return self._clock() - self._reported

    def _behind(self) -> dict[str, int]:
        return self.receipts.behind(self.barrier.now_ns - LEAD)
