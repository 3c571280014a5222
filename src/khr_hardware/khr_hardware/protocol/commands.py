"""What can be asked of the board, as frames (maker's command reference)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import IntEnum

from khr_hardware.errors import HardwareError
from khr_hardware.protocol.frames import Command, Packet
from khr_hardware.protocol.memory import RAM_SIZE, ROM_SIZE, check_ics

# Bytes that can be read at once: more fail, and a single one would look like ACK or NCK.
SHORTEST_READ, LONGEST_READ = 2, 126
LONGEST_WRITE = 121  # bytes; with its address it is a frame of 128, the most that the board takes
MAP = 5  # bytes, bit i is ICS number i

# Types of MOVE: where to, and where from.
RAM_TO_COM, LITERAL_TO_RAM, RECORD_TO_COM, LITERAL_TO_RECORD = 0x20, 0x02, 0x21, 0x12
ROM_TO_COM, LITERAL_TO_ROM = 0x23, 0x32


class ServoParameter(IntEnum):
    """What command 0x12 sets."""

    STRETCH = 1
    SPEED = 2


ACKNOWLEDGE = Packet(Command.ACKNOWLEDGE, b'\x06')
VERSION = Packet(Command.VERSION)


def read_ram(address: int, size: int) -> Packet:
    """Return the command to read from RAM."""
    _check_span(address, size, RAM_SIZE, SHORTEST_READ, LONGEST_READ)
    return Packet(Command.MOVE, bytes((RAM_TO_COM, 0, 0, 0)) + _word(address) + bytes((size,)))


def write_ram(address: int, data: bytes) -> Packet:
    """Return the command to write to RAM."""
    _check_span(address, len(data), RAM_SIZE, 1, LONGEST_WRITE)
    return Packet(Command.MOVE, bytes((LITERAL_TO_RAM,)) + _word(address) + b'\0' + data)


def read_rom(address: int, size: int) -> Packet:
    """Return the command to read from ROM."""
    _check_span(address, size, ROM_SIZE, SHORTEST_READ, LONGEST_READ)
    source = address.to_bytes(3, 'little')
    return Packet(Command.MOVE, bytes((ROM_TO_COM, 0, 0, 0)) + source + bytes((size,)))


def write_rom(address: int, data: bytes) -> Packet:
    """Return the command to write to ROM."""
    _check_span(address, len(data), ROM_SIZE, 1, LONGEST_WRITE)
    return Packet(Command.MOVE, bytes((LITERAL_TO_ROM,)) + address.to_bytes(3, 'little') + data)


def read_record(ics: int, offset: int, size: int) -> Packet:
    """Return the command to read from the record of a servo."""
    body = bytes((RECORD_TO_COM, 0, 0, 0, offset, check_ics(ics), size))
    return Packet(Command.MOVE, body)


def write_record(ics: int, offset: int, data: bytes) -> Packet:
    """Return the command to write to the record of a servo."""
    return Packet(Command.MOVE, bytes((LITERAL_TO_RECORD, offset, check_ics(ics), 0)) + data)


def call(address: int) -> Packet:
    """Return the command to call a program in ROM, whatever the flags."""
    return Packet(Command.CALL, address.to_bytes(3, 'little') + b'\0')


def move_servo(ics: int, position: int, cycles: int) -> Packet:
    """Return the command to move one servo."""
    body = bytes((check_ics(ics), _check_cycles(cycles)))
    return Packet(Command.SERVO, body + _word(position))


def move_servos(positions: Mapping[int, int], cycles: int = 1) -> Packet:
    """Return the command to move servos, by ICS number, in so many output cycles."""
    numbers = sorted(positions)
    words = b''.join(_word(positions[ics]) for ics in numbers)
    return Packet(Command.SERVOS, servo_map(numbers) + bytes((_check_cycles(cycles),)) + words)


def move_servos_each(moves: Mapping[int, tuple[int, int]]) -> Packet:
    """Return the command to move servos, each by its own cycles and position."""
    parts = [
        bytes((_check_cycles(moves[ics][0]),)) + _word(moves[ics][1]) for ics in sorted(moves)
    ]
    return Packet(Command.SERVOS_EACH, servo_map(moves) + b''.join(parts))


def set_servos(parameter: ServoParameter, values: Mapping[int, int]) -> Packet:
    """Return the command to set stretch or speed of servos, 1 to 127 each."""
    for ics, value in values.items():
        if not 1 <= value <= 127:
            raise HardwareError(
                f'ICS {ics}: {parameter.name.lower()} {value} is not accepted; accepted: 1 to 127'
            )
    ordered = bytes(values[ics] for ics in sorted(values))
    return Packet(Command.SERVO_PARAMETER, servo_map(values) + bytes((parameter,)) + ordered)


def servo_map(numbers: Iterable[int]) -> bytes:
    """Return the five bytes in which bit i stands for ICS number i."""
    return sum(1 << check_ics(ics) for ics in set(numbers)).to_bytes(MAP, 'little')


def servos_of(bits: bytes) -> list[int]:
    """Return the ICS numbers of a map, ascending."""
    value = int.from_bytes(bits, 'little')
    return [ics for ics in range(8 * MAP) if value >> ics & 1]


def _word(value: int) -> bytes:
    if not 0 <= value <= 0xFFFF:
        raise HardwareError(f'word: {value} is not accepted; accepted: 0 to 65535')
    return value.to_bytes(2, 'little')


def _check_span(address: int, size: int, end: int, fewest: int, most: int) -> None:
    if not fewest <= size <= most or not 0 <= address <= end - size:
        raise HardwareError(
            f'{size} bytes at {address:#06x} are not accepted; accepted: {fewest} to {most} '
            f'bytes below {end:#06x}'
        )


def _check_cycles(cycles: int) -> int:
    if not 1 <= cycles <= 255:
        raise HardwareError(f'cycles: {cycles} is not accepted; accepted: 1 to 255')
    return cycles
