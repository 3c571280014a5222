"""Encode commands to the board as frames (maker's command reference)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum

from khr_common.errors import KhrError
from khr_hardware.protocol.frames import Command, Packet
from khr_hardware.protocol.memory import RAM_SIZE, check_ics

# Bytes of one read: longer reads fail, and a single byte would look like ACK or NCK.
SHORTEST_READ, LONGEST_READ = 2, 126
LONGEST_WRITE = 121  # bytes; with the address a frame of 128, the longest that the board accepts
MAP = 5  # bytes, bit i is ICS number i

# Types of MOVE: source and destination.
RAM_TO_COM, LITERAL_TO_RAM, RECORD_TO_COM, LITERAL_TO_RECORD = 0x20, 0x02, 0x21, 0x12
ROM_TO_COM, LITERAL_TO_ROM = 0x23, 0x32


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
        raise KhrError(f'cycles: {cycles} is not accepted; accepted: 1 to 255')
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
        raise KhrError(f'word: {value} is not accepted; accepted: 0 to 65535')
    return value.to_bytes(2, 'little')


def _check_span(address: int, size: int, fewest: int, most: int) -> None:
    if not fewest <= size <= most or not 0 <= address <= RAM_SIZE - size:
        raise KhrError(
            f'{size} bytes at {address:#06x} are not accepted; accepted: {fewest} to {most} '
            f'bytes below {RAM_SIZE:#06x}'
        )
