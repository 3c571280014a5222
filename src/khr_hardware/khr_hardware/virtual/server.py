"""Serve a virtual board at a pseudo-terminal, with faults of the line and the board."""

from __future__ import annotations

import os
import select
import termios
import time
import tty
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fcntl import ioctl
from pathlib import Path
from random import Random
from struct import Struct

from khr_common import ParameterError, build, parameter, specifications
from khr_common.errors import KhrError
from khr_hardware.errors import PortError
from khr_hardware.protocol.commands import Packet, Splitter, decode, refusal
from khr_hardware.virtual.board import VirtualBoard

KINDS = ('lost', 'late', 'corrupt', 'nck', 'silence', 'brownout')
BROWNOUT = 0.5  # s without a reply during the loss of supply
GAP = 0.005  # s without input after which the board drops an incomplete command
TICK = 0.05  # s, longest wait for input
CHUNK = 4096
BITS = 11  # of a byte on the line: start, 8 data, parity, stop
_TCGETS2 = 0x802C542A  # struct termios2, with the speeds as numbers
_TERMIOS2 = Struct('IIIIB19sII')
_UNSET = 9600  # baud, before a client sets a rate


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


@dataclass(frozen=True)
class Wire:
    """Delays of a real line and board."""

    reply: float = 0.72e-3  # processing time of the board, s, measured by others on an RCB-4mini
    byte: float = 54e-6  # additional time for each byte that is read, s

    def time(self, request: Packet, reply: Packet, baud: int) -> float:
        """Return the time from the first byte of a command to the last byte of its reply, s."""
        sent = len(request.encode()) + len(reply.encode())
        read = len(reply.body) if len(reply.body) > 1 else 0
        return sent * BITS / baud + self.reply + read * self.byte


class Server:
    """Serve a board at a path until it is stopped.

    In real time the output cycles follow the wall clock. When *stepped*, each command that moves
    servos advances one cycle.

    Args:
        board: to serve.
        link: path of the symbolic link to the pseudo-terminal; an old link is replaced.
        stepped: whether time is stepped.
        faults: to inject; their times count from power-on.
        after_cycle: called after each output cycle; returns whether to continue.
        wire: delays of a real line and board; by default no delay.
    """

    def __init__(
        self,
        board: VirtualBoard,
        link: Path,
        stepped: bool = False,
        faults: Faults | None = None,
        after_cycle: Callable[[], bool] = lambda: True,
        wire: Wire | None = None,
    ) -> None:
        self.board = board
        self.late = 0  # cycles that began more than half a cycle late
        self.cycles = 0
        self._link = link
        self._stepped = stepped
        self._faults = faults or Faults()
        self._after_cycle = after_cycle
        self._splitter = Splitter()
        self._wire = wire
        self._outgoing: deque[tuple[float, bytes]] = deque()  # due time and bytes, in order
        self._busy_until = 0.0
        self._baud: int | None = None
        self._silent_until = 0.0
        # The ends of the board and of the client. The client's end stays open: otherwise the line
        # would hang up, and a second client could not set the same rate again.
        self._own, self._other = os.openpty()
        tty.setraw(self._other)
        self._unset_speed()
        os.set_blocking(self._own, False)
        self._make_link(os.ttyname(self._other))

    def close(self) -> None:
        """Remove the link and close the line, like a pulled cable."""
        if self._own < 0:
            return
        with suppress(OSError):
            if os.readlink(self._link) == os.ttyname(self._other):
                self._link.unlink()
        os.close(self._own)
        os.close(self._other)
        self._own = -1

    def run(self, duration: float = 0.0, stop: Callable[[], bool] = lambda: False) -> None:
        """Serve for a duration of wall time in s; 0 serves until stopped."""
        began = due = time.monotonic()
        before = 0.0
        while not stop():
            now = time.monotonic()
            if duration and now - began > duration:
                return
            if self._faults.brownout(before, now - began):
                self.board.power_on()
                self._silent_until = now + BROWNOUT
            before = now - began
            if not self._stepped and now >= due:
                cycle = self.board.config.cycle
                self.late += now - due > cycle / 2
                due = max(due + cycle, now)  # a slow computer skips cycles
                if not self._pass_cycle():
                    return
                now = time.monotonic()  # input is served although cycles may exceed their period
            self._send_due(now)
            wait = TICK if self._stepped else max(0.0, due - now)
            if self._outgoing:
                wait = min(wait, max(0.0, self._outgoing[0][0] - now))
            if self._splitter.pending:
                wait = min(wait, GAP)
            readable, _, _ = select.select([self._own], [], [], min(wait, TICK))
            if not readable:
                self._splitter.forget()
            elif not self._receive(time.monotonic(), began):
                return

    def _receive(self, now: float, began: float) -> bool:
        """Answer the received commands; return False at the end of the connection."""
        self._read_speed()
        with suppress(BlockingIOError):
            for frame in self._splitter.feed(os.read(self._own, CHUNK)):
                baud = self.board.config.baud
                if now < self._silent_until or baud is None or self._baud != baud:
                    continue  # a board ignores input at another rate
                moves = frame.command in (0x0F, 0x10, 0x11)
                reply = self.board.answer(frame)
                delay, data = self._faults.reply(now - began, reply.encode())
                if self._wire:
                    delay += self._wire.time(frame, reply, baud)
                # The board is sequential: a late reply delays the next ones.
                self._busy_until = max(self._busy_until, now) + delay
                if data:
                    self._outgoing.append((self._busy_until, data))
                self._send_due(now)
                if self._stepped and moves and not reply.refused and not self._pass_cycle():
                    return False
                if self.board.config.baud != baud:  # acknowledged at the old rate
                    self._baud = None
        return True

    def _pass_cycle(self) -> bool:
        self.board.cycle()
        self.cycles += 1
        return self._after_cycle()

    def _send_due(self, now: float) -> None:
        while self._outgoing and self._outgoing[0][0] <= now:
            _, data = self._outgoing.popleft()
            with suppress(BlockingIOError):  # a client that does not read loses the reply
                os.write(self._own, data)

    def _read_speed(self) -> None:
        """Store the rate that a client has set since the last call."""
        speed = _TERMIOS2.unpack(ioctl(self._other, _TCGETS2, bytes(_TERMIOS2.size)))[-1]
        if speed != _UNSET:
            self._baud = speed
            self._unset_speed()

    def _unset_speed(self) -> None:
        """Reset the rate; Linux refuses (EINVAL) to set the present rate again."""
        settings = termios.tcgetattr(self._other)
        settings[4] = settings[5] = termios.B9600
        settings[2] &= ~termios.CBAUD
        settings[2] |= termios.B9600
        termios.tcsetattr(self._other, termios.TCSANOW, settings)

    def _make_link(self, target: str) -> None:
        if self._link.exists() and not self._link.is_symlink():
            self.close()
            raise PortError(
                f'{self._link}: exists and is not a link; accepted: a new path, or an old link'
            )
        beside = self._link.with_name(f'{self._link.name}.{os.getpid()}')
        try:
            beside.symlink_to(target)
            beside.replace(self._link)
        except OSError as error:
            self.close()
            raise PortError(
                f'{self._link}: {error.strerror}; accepted: a path in a folder that can be written'
            ) from error
