"""Lockstep: which answers there are, which are missing, and which instant they belong to."""

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
