"""Frames and commands of the RCB-4HV (maker's command reference).

A frame is ``[size][command][body][checksum]``. The size includes all bytes of the frame; the
checksum is the low byte of the sum of all bytes before it. It detects any single wrong byte, and
misses one in 256 frames with several. The only other check is the parity of each byte, by the
serial port.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum

from khr_common.errors import KhrError
from khr_hardware.errors import BadReplyError
from khr_hardware.protocol.memory import RAM_SIZE, check_ics

ACKNOWLEDGED, NOT_ACKNOWLEDGED = 0x06, 0x15
LONGEST = 128  # bytes of a command
SHORTEST = 3
# Bytes of one read: longer reads fail, and a single byte would look like ACK or NCK.
SHORTEST_READ, LONGEST_READ = 2, 126
LONGEST_WRITE = 121  # bytes; with the address a frame of 128, the longest that the board accepts
MAP = 5  # bytes, bit i is ICS number i
# Types of MOVE: source and destination.
RAM_TO_COM, LITERAL_TO_RAM, RECORD_TO_COM, LITERAL_TO_RECORD = 0x20, 0x02, 0x21, 0x12
ROM_TO_COM, LITERAL_TO_ROM = 0x23, 0x32


class Command(IntEnum):
    """The commands that this package sends or answers."""

    MOVE = 0x00
    SERVO = 0x0F
    SERVOS = 0x10
    SERVOS_EACH = 0x11
    SERVO_PARAMETER = 0x12
    VERSION = 0xFD
    ACKNOWLEDGE = 0xFE


@dataclass(frozen=True)
class Packet:
    """A command or a reply."""

    command: int
    body: bytes = b''

    def encode(self) -> bytes:
        """Return the bytes on the wire."""
        head = bytes((len(self.body) + SHORTEST, self.command)) + self.body
        return head + bytes((checksum(head),))

    @property
    def refused(self) -> bool:
        """Return whether the reply is an NCK."""
        return self.body == bytes((NOT_ACKNOWLEDGED,))


def checksum(data: bytes) -> int:
    """Return the low byte of the sum of all bytes."""
    return sum(data) & 0xFF


def decode(data: bytes) -> Packet:
    """Decode a complete frame.

    Raises:
        BadReplyError: if the size or the checksum is wrong.
    """
    if len(data) < SHORTEST or data[0] != len(data):
        raise BadReplyError(f'frame {data.hex(" ")}: its size is wrong')
    if data[-1] != checksum(data[:-1]):
        raise BadReplyError(f'frame {data.hex(" ")}: its checksum is wrong')
    return Packet(data[1], data[2:-1])


def acknowledged(command: int) -> Packet:
    """Return the ACK of a command."""
    return Packet(command, bytes((ACKNOWLEDGED,)))


def refusal(command: int) -> Packet:
    """Return the NCK of a command."""
    return Packet(command, bytes((NOT_ACKNOWLEDGED,)))


class Splitter:
    """Split received bytes into frames, as they arrive.

    Bytes that do not begin a frame are dropped one by one, so that the next complete frame is
    always found.
    """

    def __init__(self) -> None:
        self._held = bytearray()

    def feed(self, data: bytes) -> list[Packet]:
        """Return the frames completed by the received bytes."""
        self._held += data
        found = []
        while self._held:
            size = self._held[0]
            if SHORTEST <= size <= LONGEST:
                if len(self._held) < size:
                    break
                whole = bytes(self._held[:size])
                if whole[-1] == checksum(whole[:-1]):
                    found.append(Packet(whole[1], whole[2:-1]))
                    del self._held[:size]
                    continue
            del self._held[0]
        return found

    @property
    def pending(self) -> bool:
        """Return whether a command is incomplete."""
        return bool(self._held)

    def forget(self) -> None:
        """Drop an incomplete frame after a gap in the input."""
        self._held.clear()


class ServoParameter(IntEnum):
    """The servo parameters that command 0x12 sets."""

    STRETCH = 1
    SPEED = 2


ACKNOWLEDGE = Packet(Command.ACKNOWLEDGE, b'\x06')
VERSION = Packet(Command.VERSION)


def read_ram(address: int, size: int) -> Packet:
    """Return the command to read from RAM."""
    _check_span(address, size, SHORTEST_READ, LONGEST_READ)
    return Packet(Command.MOVE, bytes((RAM_TO_COM, 0, 0, 0)) + _word(address) + bytes((size,)))


def write_ram(address: int, data: bytes) -> Packet:
    """Return the command to write to RAM."""
    _check_span(address, len(data), 1, LONGEST_WRITE)
    return Packet(Command.MOVE, bytes((LITERAL_TO_RAM,)) + _word(address) + b'\0' + data)


def move_servos(positions: Mapping[int, int], cycles: int = 1) -> Packet:
    """Return the command to move servos (by ICS number) within a number of output cycles."""
    if not 1 <= cycles <= 255:
        raise KhrError.refused('cycles', cycles, '1 to 255')
    words = b''.join(_word(positions[ics]) for ics in sorted(positions))
    return Packet(Command.SERVOS, servo_map(positions) + bytes((cycles,)) + words)


def servo_map(numbers: Iterable[int]) -> bytes:
    """Return five bytes in which bit i represents ICS number i."""
    return sum(1 << check_ics(ics) for ics in set(numbers)).to_bytes(MAP, 'little')


def servos_of(bits: bytes) -> list[int]:
    """Return the ICS numbers of a bit map, ascending."""
    value = int.from_bytes(bits, 'little')
    return [ics for ics in range(8 * MAP) if value >> ics & 1]


def _word(value: int) -> bytes:
    if not 0 <= value <= 0xFFFF:
        raise KhrError.refused('word', value, '0 to 65535')
    return value.to_bytes(2, 'little')


def _check_span(address: int, size: int, fewest: int, most: int) -> None:
    if not fewest <= size <= most or not 0 <= address <= RAM_SIZE - size:
        raise KhrError(
            f'{size} bytes at {address:#06x} are not accepted; accepted: {fewest} to {most} '
            f'bytes below {RAM_SIZE:#06x}'
        )
