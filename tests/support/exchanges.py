"""Exchanges of every kind with a board whose memory is at hand, and frames of other software.

The frames ask what this project does not (maker's reference).
"""

from khr_hardware.client import Client
from khr_hardware.protocol import memory
from khr_hardware.protocol.commands import (
    LITERAL_TO_RECORD,
    LITERAL_TO_ROM,
    RECORD_TO_COM,
    ROM_TO_COM,
    Command,
    Packet,
    servo_map,
)
from tests.fakes.boards import TRIMS

FREELY = range(0x1A0, 0x200)  # RAM of records that no servo of the bench has


def exchange(client: Client, board, rng):
    """Ask for something, or write it, and compare with the board's memory.

    Raises:
        BoardError: if the exchange failed.
    """
    kind = rng.choice(['read', 'read', 'write', 'version', 'record', 'config', 'measured', 'move'])
    ics = rng.choice(sorted(TRIMS))
    if kind == 'read':
        address, size = rng.randrange(0x100, 0x180), rng.choice([2, 8, 22, 126])
        assert client.read_ram(address, size) == board.ram[address : address + size]
    elif kind == 'write':
        data = rng.randbytes(rng.choice([1, 3, 40]))
        address = rng.randrange(FREELY.start, FREELY.stop - len(data))
        client.write_ram(address, data)
        assert board.ram[address : address + len(data)] == data
    elif kind == 'version':
        assert client.version() == memory.VERSION
    elif kind == 'record':
        assert client.record(ics) == board.record(ics)
    elif kind == 'config':
        assert client.config() == board.config
    elif kind == 'measured':
        assert client.measured(ics) == board.record(ics).measured
    else:
        position = rng.randrange(7000, 8000)
        client.move({ics: position})
        assert board.record(ics).end == position


def read_rom(address, size):
    source = address.to_bytes(3, 'little')
    return Packet(Command.MOVE, bytes((ROM_TO_COM, 0, 0, 0)) + source + bytes((size,)))


def write_rom(address, data):
    return Packet(Command.MOVE, bytes((LITERAL_TO_ROM,)) + address.to_bytes(3, 'little') + data)


def read_record(ics, offset, size):
    return Packet(Command.MOVE, bytes((RECORD_TO_COM, 0, 0, 0, offset, ics, size)))


def write_record(ics, offset, data):
    return Packet(Command.MOVE, bytes((LITERAL_TO_RECORD, offset, ics, 0)) + data)


def move_servo(ics, position, cycles):
    return Packet(Command.SERVO, bytes((ics, cycles)) + position.to_bytes(2, 'little'))


def move_servos_each(moves):
    """Move servos, each by its own cycles and position."""
    parts = [
        bytes((moves[ics][0],)) + moves[ics][1].to_bytes(2, 'little') for ics in sorted(moves)
    ]
    return Packet(Command.SERVOS_EACH, servo_map(moves) + b''.join(parts))


def set_servos(parameter, values):
    """Set stretch or speed of servos."""
    ordered = bytes(values[ics] for ics in sorted(values))
    return Packet(Command.SERVO_PARAMETER, servo_map(values) + bytes((parameter,)) + ordered)
