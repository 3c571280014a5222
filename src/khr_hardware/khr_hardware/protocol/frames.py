"""Frames of the RCB-4HV: ``[size][command][body][checksum]`` (maker's command reference).

The size includes all bytes of the frame; the checksum is the low byte of the sum of all bytes
before it. It detects any single wrong byte, and misses one in 256 frames with several. The only
other check is the parity of each byte, by the serial port.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from khr_hardware.errors import BadReplyError

ACKNOWLEDGED, NOT_ACKNOWLEDGED = 0x06, 0x15
LONGEST = 128  # bytes of a command
SHORTEST = 3


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
