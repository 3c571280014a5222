"""What the nodes share that put together what they hear of an instant, and answer it once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from geometry_msgs.msg import WrenchStamped

from khr_common import cdr
from khr_common.nodes.node import KhrNode
from khr_common.stamps import StampedSet, StampJudge

RECENT = 4  # instants; lockstep has two under way
Inputs = Mapping[str, tuple[type[Any], Callable[[bytes], Any]]]  # message and reader by topic

FOOT_FORCES: Inputs = {
    f'foot_force/{region}': (WrenchStamped, lambda force: cdr.force(force)[2])
    for region in ('left_toe', 'left_heel', 'right_toe', 'right_heel')
}


class InstantNode(KhrNode, ABC):
    """Answer each instant when a message of every topic of a group has come.

    A node may listen to several groups, and change from which of them it answers. It hears all of
    them all the time, so that a change leaves no instant without an answer.
    """

    def __init__(self, name: str, table: type[Any]) -> None:
        super().__init__(name, table)
        self._judge = StampJudge(self.restart)
        self._recent: dict[str, deque[tuple[int, Sequence[Any]]]] = {}
        self._group = ''

    def restart(self) -> None:
        """Forget the run so far; a node whose core has a memory overrides this."""

    @abstractmethod
    def compute(self, time: float, heard: Sequence[Any]) -> None:
        """Step the core with what was heard of the instant ``time`` s, in order of the topics."""

    @abstractmethod
    def send(self, stamp_ns: int) -> None:
        """Publish what was computed last, stamped ``stamp_ns``."""

    def listen_for(self, inputs: Inputs, group: str = '') -> None:
        """Listen to a group of topics."""
        gathered = StampedSet(tuple(inputs))
        self._recent[group] = deque(maxlen=RECENT)
        for topic, (kind, read) in inputs.items():
            self.listen_to_bytes(kind, topic, partial(self._hear, group, gathered, topic, read))

    def answer_from(self, group: str) -> None:
        """Answer from this group, also what it has told and the one before has not."""
        self._group = group
        for stamp_ns, heard in self._recent[group]:
            if stamp_ns > self._judge.last:
                self._take(stamp_ns, heard)

    def _hear(
        self,
        group: str,
        gathered: StampedSet,
        topic: str,
        read: Callable[[bytes], Any],
        message: bytes,
    ) -> None:
        stamp_ns = cdr.clock(message)
        heard = gathered.put(topic, stamp_ns, read(message))
        if heard is None:
            return
        recent = self._recent[group]
        another_run = bool(recent) and stamp_ns < recent[-1][0]
        if another_run:
            recent.clear()
        recent.append((stamp_ns, heard))
        # What is older than the last answer, in the same run, another group has answered.
        if group == self._group and (another_run or stamp_ns >= self._judge.last):
            self._take(stamp_ns, heard)

    def _take(self, stamp_ns: int, heard: Sequence[Any]) -> None:
        if self._judge.is_new(stamp_ns):  # once per stamp, however often it is asked for
            self.compute(stamp_ns / 1e9, heard)
        self.send(stamp_ns)
