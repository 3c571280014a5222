"""What others may ask of the board and this project does not, as frames (maker's reference)."""

from khr_hardware.protocol.commands import (
    LITERAL_TO_RECORD,
    LITERAL_TO_ROM,
    RECORD_TO_COM,
    ROM_TO_COM,
    Command,
    Packet,
    servo_map,
)


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
