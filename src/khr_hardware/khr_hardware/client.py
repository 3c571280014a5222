"""A strict client of the board: it accepts only complete replies, and every wait has a timeout.

The protocol has no sequence numbers, so a late reply looks like the reply to the next request of
its kind. Therefore the client synchronises after every failed exchange (a *fence*): it reads a few
bytes of RAM and drops all input before them, because the board answers in order. Consecutive
fences read different lengths, so a late reply to an earlier fence is not taken for the last one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import cycle
from struct import iter_unpack
from typing import TypeVar

from serial import SerialTimeoutException

from khr_hardware.errors import BadReplyError, BoardError, NoReplyError, PortError, RefusedError
from khr_hardware.port import Port, open_port
from khr_hardware.protocol import commands, memory
from khr_hardware.protocol.commands import SHORTEST, Command, Packet, acknowledged, decode
from khr_hardware.protocol.memory import BAUD_RATES, Config, Mixing, ServoRecord

TIMEOUT = 0.02  # s for the first byte of a reply, and for the others together
RETRIES = 2  # retries of an exchange
FENCES = 3  # fences before the line counts as dead
FENCE_SIZES = range(3, 33)  # bytes read by consecutive fences
ACK_SIZE = 4  # bytes of an ACK, and of an NCK
FLOOD = 4096  # input bytes of a fence before the line counts as dead

Value = TypeVar('Value')


@dataclass
class Counts:
    """Counts of the exchanges so far, by kind of error."""

    exchanges: int = 0
    retries: int = 0
    timeouts: int = 0  # no reply at all
    short: int = 0  # incomplete reply
    size: int = 0  # reply of another length
    checksum: int = 0
    command: int = 0  # reply to another command
    refused: int = 0  # NCK
    stray: int = 0  # unexpected bytes
    failed: int = 0  # exchanges given up, and positions of servos that do not answer

    def figures(self) -> dict[str, str]:
        """Return the counts as texts."""
        return {name: str(value) for name, value in asdict(self).items()}


class Client:
    """Exchange commands and replies with the board.

    Args:
        port: open serial line; reads have a timeout.
        retries: of a failed exchange.

    Attributes:
        counts: exchanges and errors by kind.
        closed: reason why the port is closed; empty while it is open. It is never reopened.
    """

    def __init__(self, port: Port, retries: int = RETRIES) -> None:
        self._port = port
        self._retries = retries
        self.counts = Counts()
        self.closed = ''
        self._reply_pending = False  # whether a late reply may still arrive
        self._asked: set[int] = set()  # sizes of the replies that may still arrive
        self._fence_sizes = cycle(FENCE_SIZES)

    # ---- exchanges ----

    def exchange(self, request: Packet, size: int) -> bytes:
        """Send a command and return the data of its reply.

        Args:
            request: the command.
            size: bytes of data; 0 for a command that is only acknowledged.

        Raises:
            RefusedError: if the board refused every attempt.
            NoReplyError, BadReplyError: if no attempt got a valid reply.
            PortError: if the port is closed or gone.
        """
        if self.closed:
            raise PortError(self.closed)
        self.counts.exchanges += 1
        if self._reply_pending:
            self._use_port(self._fence)
        for left in reversed(range(self._retries + 1)):
            try:
                self._asked.add(size)
                data = self._use_port(lambda: self._attempt(request, size))
                self._asked.clear()
                return data
            except PortError:
                raise
            except BoardError as error:
                if not isinstance(error, RefusedError):
                    self._reply_pending = True
                    self._use_port(self._fence)
                if not left:
                    self.counts.failed += 1
                    raise
                self.counts.retries += 1
        raise AssertionError('not reached')

    def command(self, request: Packet) -> None:
        """Send a command that the board only acknowledges; raises as :meth:`exchange` does."""
        self.exchange(request, 0)

    def _attempt(self, request: Packet, size: int) -> bytes:
        if self._port.in_waiting:
            self._drop(self._port.in_waiting)
            raise BadReplyError('unexpected bytes before the command')
        self._port.write(request.encode())
        first = self._port.read(1)
        if not first:
            self.counts.timeouts += 1
            raise NoReplyError(f'no reply to command {request.command:#04x}')
        expected = size + SHORTEST if size else ACK_SIZE
        if first[0] not in (expected, ACK_SIZE):
            self.counts.size += 1
            raise BadReplyError(
                f'reply of {first[0]} bytes to command {request.command:#04x}; expected: {expected}'
            )
        rest = self._port.read(first[0] - 1)
        if len(rest) < first[0] - 1:
            self.counts.short += 1
            raise NoReplyError(f'incomplete reply to command {request.command:#04x}')
        if self._port.in_waiting:
            self._drop(self._port.in_waiting)
            raise BadReplyError(f'unexpected bytes after the reply to {request.command:#04x}')
        return self._accept(request, size, first + rest)

    def _accept(self, request: Packet, size: int, data: bytes) -> bytes:
        try:
            reply = decode(data)
        except BadReplyError:
            self.counts.checksum += 1
            raise
        if reply.command != request.command:
            self.counts.command += 1
            raise BadReplyError(
                f'reply to command {reply.command:#04x}; expected: {request.command:#04x}'
            )
        if reply.refused:
            self.counts.refused += 1
            raise RefusedError(f'the board refuses command {request.command:#04x}')
        if size and len(reply.body) == size:
            return reply.body
        if reply == acknowledged(request.command) and not size:
            return b''
        self.counts.size += 1
        raise BadReplyError(f'reply {data.hex(" ")} to command {request.command:#04x}')

    def _fence(self) -> None:
        """Read RAM of a unique length and drop all input before its reply.

        Raises:
            NoReplyError: if the reply does not come.
        """
        for _ in range(FENCES):
            if self._port.in_waiting:
                self._drop(self._port.in_waiting)
            size = next(each for each in self._fence_sizes if each not in self._asked)
            self._port.write(commands.read_ram(0, size).encode())
            seen = b''
            while (byte := self._port.read(1)) and len(seen) < FLOOD:
                seen += byte
                if _is_read(seen[-size - SHORTEST :], size) and not self._port.in_waiting:
                    self.counts.stray += len(seen) - size - SHORTEST
                    self._reply_pending = False
                    self._asked.clear()
                    return
            self.counts.stray += len(seen)
        self.counts.failed += 1
        raise NoReplyError('the board does not answer')

    def _drop(self, size: int) -> None:
        self.counts.stray += len(self._port.read(size))

    def _use_port(self, action: Callable[[], Value]) -> Value:
        """Call an action on the port; close the client if the port is gone."""
        try:
            return action()
        except SerialTimeoutException as error:  # also if the computer stalls after the write
            self.counts.timeouts += 1
            raise NoReplyError('the line did not take a command in time') from error
        except (OSError, TypeError) as error:  # pyserial raises these for a closed port
            self.close(f'the port is gone ({getattr(error, "strerror", None) or error})')
            raise PortError(self.closed) from error

    def close(self, reason: str = 'the port is closed') -> None:
        """Close the port for good."""
        if not self.closed:
            self.closed = reason
            self._port.close()

    # ---- commands ----

    def acknowledge(self) -> None:
        """Check that the board answers."""
        self.command(commands.ACKNOWLEDGE)

    def version(self) -> bytes:
        """Return the 32 bytes of the firmware's version."""
        return self.exchange(commands.VERSION, len(memory.VERSION))

    def read_ram(self, address: int, size: int) -> bytes:
        """Return bytes of RAM, split into several reads if necessary."""
        parts = []
        while size > 0:
            part = min(size, commands.LONGEST_READ)
            part -= size - part == 1  # a single byte cannot be read
            parts.append(self.exchange(commands.read_ram(address, part), part))
            address, size = address + part, size - part
        return b''.join(parts)

    def write_ram(self, address: int, data: bytes) -> None:
        """Write bytes to RAM."""
        self.command(commands.write_ram(address, data))

    def config(self) -> Config:
        """Return the configuration word."""
        return Config(int.from_bytes(self.read_ram(memory.CONFIG, 2), 'little'))

    def set_config(self, config: Config) -> None:
        """Write the configuration word."""
        self.write_ram(memory.CONFIG, config.word.to_bytes(2, 'little'))

    def ad(self) -> tuple[int, ...]:
        """Return the AD readings minus their references, in AD steps."""
        return _words(self.read_ram(memory.AD_VALUES, 2 * memory.AD_CHANNELS))

    def ad_references(self) -> tuple[int, ...]:
        """Return the references of the AD channels, in steps."""
        return _words(self.read_ram(memory.AD_REFERENCES, 2 * memory.AD_CHANNELS))

    def set_ad_reference(self, channel: int, value: int) -> None:
        """Write the reference of an AD channel, in steps."""
        data = value.to_bytes(2, 'little', signed=True)
        self.write_ram(memory.AD_REFERENCES + 2 * channel, data)

    def assigned(self) -> list[int]:
        """Return the ICS numbers assigned in the board."""
        words = iter_unpack('<H', self.read_ram(memory.ICS_TABLE, 2 * memory.ICS_NUMBERS))
        return [ics for ics, (word,) in enumerate(words) if word != memory.UNASSIGNED]

    def record(self, ics: int) -> ServoRecord:
        """Return the record of a servo."""
        return ServoRecord.decode(self.read_ram(memory.record_address(ics), memory.RECORD_SIZE))

    def measured(self, ics: int) -> int:
        """Return the last reported position of a servo minus its trim, counts.

        Raises:
            NoReplyError: if the servo does not answer; its position is then 0.
        """
        address = memory.record_address(ics) + memory.MEASURED
        position = int.from_bytes(self.read_ram(address, 2), 'little')
        if not position:
            self.counts.failed += 1
            raise NoReplyError(f'no answer from the servo with ICS number {ics}')
        return position

    def set_mixing(self, ics: int, slot: int, mixing: Mixing) -> None:
        """Write source and ratio of one of the two mixings of a servo, in one write."""
        address = memory.record_address(ics) + memory.MIXINGS[slot]
        self.write_ram(address, mixing.encode())

    def move(self, positions: Mapping[int, int], cycles: int = 1) -> None:
        """Move servos (positions in counts by ICS number) within a number of output cycles."""
        self.command(commands.move_servos(positions, cycles))

    def free(self, numbers: Sequence[int]) -> None:
        """Switch the torque of servos off, by ICS number.

        While a reply is outstanding, the command is also written before the line is synchronised.

        Raises:
            BoardError: if the board does not confirm it.
        """
        request = commands.move_servos(dict.fromkeys(numbers, memory.FREE))
        if self._reply_pending and not self.closed:
            self._use_port(lambda: self._port.write(request.encode()))
        self.command(request)


def connect(path: str, baud: int = 0, timeout: float = TIMEOUT) -> tuple[Client, int]:
    """Open a port and find the rate at which the board answers.

    Args:
        path: of the port.
        baud: rate; 0 tries all three.
        timeout: of a reply, s.

    Returns:
        The client and the rate.

    Raises:
        PortError: if the port cannot be opened.
        NoReplyError: if no board answers at any rate.
    """
    rates = (baud,) if baud else tuple(reversed(BAUD_RATES))
    for rate in rates:
        client = Client(open_port(path, rate, timeout))
        try:
            client.acknowledge()
        except BoardError:
            client.close()
            continue
        client.counts = Counts()
        return client, rate
    tried = ', '.join(str(rate) for rate in rates)
    raise NoReplyError(
        f'{path}: no board answers at {tried} baud; accepted: an RCB-4HV that is switched on'
    )


def _is_read(data: bytes, size: int) -> bool:
    """Return whether the bytes are the reply to a read of ``size`` bytes."""
    try:
        reply = decode(data)
    except BadReplyError:
        return False
    return reply.command == Command.MOVE and len(reply.body) == size


def _words(data: bytes) -> tuple[int, ...]:
    return tuple(word for (word,) in iter_unpack('<h', data))
