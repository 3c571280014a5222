"""Inject faults of the line and the board, to test clients."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from random import Random

from khr_common import ParameterError, build, parameter, specifications
from khr_common.errors import KhrError
from khr_hardware.protocol.frames import decode, refusal

KINDS = ('lost', 'late', 'corrupt', 'nck', 'silence', 'brownout')
BROWNOUT = 0.5  # s without a reply during the loss of supply


@dataclass(frozen=True)
class Fault:
    """A series of faults."""

    kind: str = parameter(
        '', 'Kind; brownout restarts the board, which frees its servos.', choices=KINDS
    )
    start: float = parameter(0.0, 'Time after power-on.', '[0, 1e6] s')
    count: int = parameter(1, 'Number of affected replies.', '[1, inf]')
    duration: float = parameter(
        0.05, 'Delay of a late reply, or length of the silence.', '[0, 1e6] s'
    )

    @classmethod
    def parse(cls, text: str) -> Fault:
        """Read ``kind=lost start=2.0 count=3 duration=0.05``; only the kind is required."""
        known, words = specifications(cls), (word.partition('=') for word in text.split())
        try:
            return build(
                cls, {'kind': '', **{key: known[key].kind(value) for key, _, value in words}}
            )
        except (KeyError, ValueError, ParameterError) as error:
            raise KhrError(
                f'fault: {text!r:.80} is not accepted; accepted: "kind=KIND start=S count=N '
                f'duration=S", KIND one of {" | ".join(KINDS)}'
            ) from error


class Faults:
    """Inject faults into the replies of a board; the corrupted bytes are reproducible."""

    def __init__(self, faults: Sequence[Fault] = ()) -> None:
        self._faults: list[Fault] = []
        self._left: list[int] = []
        self._random = Random(0)
        self._now = 0.0  # time after power-on, s
        self.add(*faults)

    def add(self, *faults: Fault) -> None:
        """Add faults; their start times are relative to now."""
        for fault in faults:
            self._left.append(fault.count)
            self._faults.append(replace(fault, start=self._now + fault.start))

    def reply(self, now: float, data: bytes) -> tuple[float, bytes]:
        """Return the delay in s and the bytes to send in place of a reply, which may be empty."""
        delay = 0.0
        for i, fault in enumerate(self._faults):
            if now < fault.start or fault.kind == 'brownout':
                continue
            if fault.kind == 'silence':
                data = b'' if now < fault.start + fault.duration else data
            elif self._left[i] and data:
                self._left[i] -= 1
                delay, data = self._corrupt(fault, delay, data)
        return delay, data

    def _corrupt(self, fault: Fault, delay: float, data: bytes) -> tuple[float, bytes]:
        if fault.kind == 'lost':
            return delay, b''
        if fault.kind == 'late':
            return delay + fault.duration, data
        if fault.kind == 'nck':
            return delay, refusal(decode(data).command).encode()
        place = self._random.randrange(len(data))
        changed = bytearray(data)
        changed[place] ^= self._random.randrange(1, 256)
        return delay, bytes(changed)

    def brownout(self, before: float, now: float) -> bool:
        """Return whether a brown-out starts between two times."""
        self._now = now
        breaks = [fault.start for fault in self._faults if fault.kind == 'brownout']
        return any(before <= start < now for start in breaks)
