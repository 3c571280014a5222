"""Lockstep: the answers to an instant, and how far each listener has received the run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, TypeVar

Answer = TypeVar('Answer')


class Barrier(Generic[Answer]):
    """Hold the answers to the instants of one run until they are due.

    The first answer of a source to an instant counts; a second one changes nothing. An answer to
    an instant that has not been yet is one of an earlier run, and is refused.
    """

    def __init__(self, sources: Sequence[str]) -> None:
        self._sources = tuple(sources)
        self._answers: dict[int, dict[str, Answer]] = {}
        self._newest: dict[str, Answer] = {}
        self._now = -1

    def open(self, stamp_ns: int) -> None:
        """Begin to take answers to the instant ``stamp_ns``; forget all but the one before."""
        self._answers = {
            stamp: answers for stamp, answers in self._answers.items() if stamp == self._now
        } | {stamp_ns: {}}
        self._now = stamp_ns

    def put(self, source: str, stamp_ns: int, answer: Answer) -> bool:
        """Take an answer; return whether it is one that was asked for."""
        if stamp_ns > self._now:
            return False
        self._newest[source] = answer
        if stamp_ns not in self._answers:
            return False
        self._answers[stamp_ns].setdefault(source, answer)
        return True

    def missing(self, stamp_ns: int) -> list[str]:
        """List the sources that have not answered to the instant ``stamp_ns``."""
        given = self._answers.get(stamp_ns, {})
        return [source for source in self._sources if source not in given]

    def at(self, stamp_ns: int) -> dict[str, Answer]:
        """Return the answers to the instant ``stamp_ns`` by source."""
        return self._answers.get(stamp_ns, {})

    def newest(self) -> dict[str, Answer]:
        """Return the last answer of each source, to whatever instant."""
        return self._newest


class Receipts:
    """Up to when each listener has received a run, ns; one that has never reported is absent."""

    def __init__(self, listeners: Sequence[str]) -> None:
        self._listeners = [name for name in listeners if name]
        self._up_to: dict[str, int] = {}

    def begin(self) -> None:
        """Begin a run at time 0; who has reported is still there."""
        self._up_to = dict.fromkeys(self._up_to, 0)

    def take(self, name: str, stamp_ns: int, now_ns: int) -> bool:
        """Take a report; return whether it is a listener's, and not from before a reset."""
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
