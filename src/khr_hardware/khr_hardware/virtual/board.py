"""Simulate the board: memory, commands and output cycle of the RCB-4HV.

It answers the commands in docs/hardware.md by the maker's references, and all others with NCK.
Programs in ROM are stored and not run. The board is independent of ports and time: the caller
passes frames and advances the cycles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from struct import iter_unpack
from typing import Protocol

from khr_hardware.protocol import memory
from khr_hardware.protocol.commands import (
    LITERAL_TO_RAM,
    LITERAL_TO_RECORD,
    LITERAL_TO_ROM,
    LONGEST_READ,
    MAP,
    RAM_TO_COM,
    RECORD_TO_COM,
    ROM_TO_COM,
    Command,
    Packet,
    ServoParameter,
    acknowledged,
    refusal,
    servos_of,
)
from khr_hardware.protocol.memory import Config, Mixing, ServoRecord, record_address


class BoardRobot(Protocol):
    """A robot simulated in output cycles; positions are raw servo counts, trim included."""

    def measure(self) -> Mapping[int, int]:
        """Return the positions of the existing servos by ICS number."""

    def sense(self) -> Mapping[int, int]:
        """Return the AD conversions, in steps from 0 to 1023; a missing channel is open."""

    def drive(self, positions: Mapping[int, int], cycle: float) -> None:
        """Advance one cycle with each servo moved to a position or freed.

        Args:
            positions: counts by ICS number, or ``FREE``; other servos keep their last position.
            cycle: duration, s.
        """

    def stiffen(self, stretch: Mapping[int, int]) -> None:
        """Set the stretch of servos, 1 to 127, by ICS number."""


class _NotAcceptedError(Exception):
    """The board answers the command with NCK."""


@dataclass(frozen=True)
class PowerOnSettings:
    """Settings of the project in a board's ROM at power-on."""

    trims: Mapping[int, int]  # of the assigned servos, by ICS number
    # configuration word; by default the maker's project for the KHR-3HV with the ROM program off,
    # because it is not modelled
    config: int = 0x8091
    ad_references: Mapping[int, int] | None = None  # by AD channel, in steps
    # output cycles between the conversion of an AD channel and the position with its mixing
    # (unconfirmed)
    mixing_delay: int = 1
    version: bytes = memory.VERSION  # of the firmware, 32 bytes


class VirtualBoard:
    """An RCB-4HV connected to a robot.

    Attributes:
        ram, rom: memory; unwritten ROM is 0xFF.
        sent: positions sent to the servos in the last cycle, by ICS number, with trim and
            mixing; ``FREE`` for a servo without torque.
    """

    def __init__(self, robot: BoardRobot, setup: PowerOnSettings) -> None:
        self.robot = robot
        self.setup = setup
        self.rom = bytearray(b'\xff' * memory.ROM_SIZE)
        self._handlers: dict[int, Callable[[bytes], bytes]] = {
            Command.ACKNOWLEDGE: self._acknowledge,
            Command.VERSION: self._version,
            Command.MOVE: self._move,
            Command.SERVO: self._servo,
            Command.SERVOS: self._servos,
            Command.SERVOS_EACH: self._servos_each,
            Command.SERVO_PARAMETER: self._parameter,
        }
        self.power_on()

    def power_on(self) -> None:
        """Reset the RAM to the power-on settings and free the servos."""
        self.ram = bytearray(memory.RAM_SIZE)
        self.sent: dict[int, int] = {}
        # Positions of the holding servos at the time of the command.
        self._held: dict[int, int] = {}
        self._put(memory.CONFIG, self.setup.config)
        for channel, value in (self.setup.ad_references or {}).items():
            self._put(memory.AD_REFERENCES + 2 * channel, value)
        empty = (Mixing(memory.NO_SOURCE, 1), Mixing(memory.NO_SOURCE, 1))
        for ics in range(memory.ICS_NUMBERS):
            trim = self.setup.trims.get(ics)
            address = memory.UNASSIGNED if trim is None else record_address(ics)
            self._put(memory.ICS_TABLE + 2 * ics, address)
            reference = memory.CENTRE if trim is None else memory.FREE
            record = ServoRecord(1, ics, trim or 0, 0, reference, 0, memory.CENTRE, 0, 0, empty)
            start = record_address(ics)
            self.ram[start : start + memory.RECORD_SIZE] = record.encode()
        self.sample()
        self._delayed = [self._ad()] * self.setup.mixing_delay

    @property
    def config(self) -> Config:
        """Return the configuration word."""
        return Config(self._word(memory.CONFIG))

    def record(self, ics: int) -> ServoRecord:
        """Return the record of a servo."""
        address = record_address(ics)
        return ServoRecord.decode(bytes(self.ram[address : address + memory.RECORD_SIZE]))

    # ---- commands ----

    def answer(self, frame: Packet) -> Packet:
        """Execute a command and return the reply: its data, an ACK, or an NCK."""
        try:
            _require(frame.command in self._handlers)
            data = self._handlers[frame.command](frame.body)
        except _NotAcceptedError:
            return refusal(frame.command)
        return Packet(frame.command, data) if data else acknowledged(frame.command)

    def _acknowledge(self, body: bytes) -> bytes:
        _require(body in (b'', b'\x06'))
        return b''

    def _version(self, body: bytes) -> bytes:
        _require(not body)
        return self.setup.version

    def _move(self, body: bytes) -> bytes:
        _require(bool(body))
        kind, rest = body[0], body[1:]
        if kind in (RAM_TO_COM, ROM_TO_COM, RECORD_TO_COM):
            _require(rest[:3] == b'\0\0\0')
            return self._read(kind, rest[3:])
        if kind in (LITERAL_TO_RAM, LITERAL_TO_ROM, LITERAL_TO_RECORD):
            _require(len(rest) > 3)
            self._write(kind, rest[:3], rest[3:])
            return b''
        raise _NotAcceptedError

    def _read(self, kind: int, source: bytes) -> bytes:
        _require(len(source) == (4 if kind == ROM_TO_COM else 3))
        size = source[-1]
        _require(1 <= size <= LONGEST_READ)
        if kind == ROM_TO_COM:
            start = int.from_bytes(source[:3], 'little')
            _require(start + size <= memory.ROM_SIZE)
            return bytes(self.rom[start : start + size])
        if kind == RAM_TO_COM:
            start = int.from_bytes(source[:2], 'little')
            _require(start + size <= memory.RAM_SIZE)
        else:
            start = self._in_record(source[0], source[1], size)
        return bytes(self.ram[start : start + size])

    def _write(self, kind: int, target: bytes, data: bytes) -> None:
        if kind == LITERAL_TO_ROM:
            start = int.from_bytes(target, 'little')
            _require(start + len(data) <= memory.ROM_SIZE)
            self.rom[start : start + len(data)] = data
            return
        _require(target[2] == 0)
        if kind == LITERAL_TO_RAM:
            start = int.from_bytes(target[:2], 'little')
            _require(start + len(data) <= memory.RAM_SIZE)
        else:
            start = self._in_record(target[0], target[1], len(data))
        self.ram[start : start + len(data)] = data
        if start < memory.AD_REFERENCES + 2 * memory.AD_CHANNELS:
            self._convert()  # a new reference takes effect without delay

    def _in_record(self, offset: int, ics: int, size: int) -> int:
        _require(ics < memory.ICS_NUMBERS and offset + size <= memory.RECORD_SIZE)
        return record_address(ics) + offset

    def _servo(self, body: bytes) -> bytes:
        _require(len(body) == 4)
        self._start(iter_unpack('<BBH', body))
        return b''

    def _servos(self, body: bytes) -> bytes:
        numbers = servos_of(body[:MAP])
        _require(len(body) == MAP + 1 + 2 * len(numbers))
        words = iter_unpack('<H', body[MAP + 1 :])
        self._start((ics, body[MAP], word) for ics, (word,) in zip(numbers, words, strict=True))
        return b''

    def _servos_each(self, body: bytes) -> bytes:
        numbers = servos_of(body[:MAP])
        _require(len(body) == MAP + 3 * len(numbers))
        moves = iter_unpack('<BH', body[MAP:])
        self._start((ics, *move) for ics, move in zip(numbers, moves, strict=True))
        return b''

    def _parameter(self, body: bytes) -> bytes:
        numbers = servos_of(body[:MAP])
        _require(len(body) == MAP + 1 + len(numbers) and body[MAP] in tuple(ServoParameter))
        values = body[MAP + 1 :]
        _require(all(1 <= value <= 127 for value in values))
        _require(all(ics < memory.ICS_NUMBERS for ics in numbers))
        if body[MAP] == ServoParameter.STRETCH:
            self.robot.stiffen(dict(zip(numbers, values, strict=True)))
        return b''

    def _start(self, moves: Iterable[tuple[int, ...]]) -> None:
        """Start moves (ICS number, cycles, position); reject all if one is invalid."""
        chosen = list(moves)
        _require(all(ics < memory.ICS_NUMBERS and cycles for ics, cycles, _ in chosen))
        for ics, cycles, position in chosen:
            old = self.record(ics)
            if position in (memory.FREE, memory.HOLD):
                # Free and hold take effect at once; the cycles are counted down nevertheless.
                self._held[ics] = (
                    old.measured
                    if old.reference == memory.FREE
                    else self._start_position(ics, old)
                )
                changes = {memory.REFERENCE: position}
            else:
                changes = {memory.REFERENCE: self._start_position(ics, old)}
            changes |= {memory.END: position, memory.WIDTH: cycles}
            start = record_address(ics)
            for offset, value in changes.items():
                self._put(start + offset, value)
            self.ram[start + memory.SPEED] = self.ram[start + memory.STEPS_LEFT] = cycles

    def _start_position(self, ics: int, record: ServoRecord) -> int:
        """Return the start of the next move: the reference, or the held or measured position."""
        if record.reference == memory.HOLD:
            return self._held.get(ics, record.measured)
        return record.measured if record.reference == memory.FREE else record.reference

    # ---- output cycle ----

    def cycle(self) -> None:
        """Advance one output cycle: send positions, then sample the servos and the AD ports."""
        self._delayed.append(self._ad())
        ad = self._delayed.pop(0)
        self.sent = self._outputs(ad) if self._bus_on else {}
        self.robot.drive(self.sent, self.config.cycle)
        self.sample()

    @property
    def _bus_on(self) -> bool:
        """Return whether the servo bus is on, at the rate of the servos."""
        return self.config.ics and self.config.ics_code == Config(self.setup.config).ics_code

    def _assigned(self, ics: int) -> bool:
        return self._word(memory.ICS_TABLE + 2 * ics) == record_address(ics)

    def _outputs(self, ad: tuple[int, ...]) -> dict[int, int]:
        """Advance the references and return the positions to send to the assigned servos."""
        sent = {}
        for ics in range(memory.ICS_NUMBERS):
            if not self._assigned(ics):
                continue
            record = self._step(ics, self.record(ics))
            if record.reference == memory.FREE:
                sent[ics] = memory.FREE
                continue
            position = self._start_position(ics, record) + record.trim
            position += sum(self._mixed(mixing, ad) for mixing in record.mixings)
            sent[ics] = min(max(position, memory.LOWEST), memory.HIGHEST)
        return sent

    def _step(self, ics: int, record: ServoRecord) -> ServoRecord:
        """Advance the reference by one step of its move."""
        left = record.steps_left
        if not left or not record.speed:  # a client stops a move with speed 0
            return record
        start = record_address(ics)
        if record.reference not in (memory.FREE, memory.HOLD):
            step = (record.end - record.reference) / left
            self._put(start + memory.REFERENCE, record.reference + round(step))
        self.ram[start + memory.STEPS_LEFT] = left - 1
        if left == 1:
            self.ram[start + memory.SPEED] = 0
        return self.record(ics)

    def _mixed(self, mixing: Mixing, ad: tuple[int, ...]) -> int:
        """Return the offset of a mixing; 0 for a source other than an AD channel (not modelled)."""
        channel = mixing.ad_channel if mixing.active else None
        return 0 if channel is None else mixing.factor * ad[channel]

    def sample(self) -> None:
        """Sample the servos and the AD ports."""
        if self._bus_on:
            for ics, position in self.robot.measure().items():
                if self._assigned(ics):
                    start = record_address(ics)
                    trim = self._signed(start + memory.TRIM)
                    self._put(start + memory.MEASURED, min(max(position - trim, 1), 0x7FFE))
        self._converted = dict(self.robot.sense())
        self._convert()

    def _convert(self) -> None:
        """Store the reading of each AD channel minus its reference."""
        for channel in range(memory.AD_CHANNELS):
            raw = min(max(self._converted.get(channel, 0), 0), memory.AD_TOP)
            reference = self._signed(memory.AD_REFERENCES + 2 * channel)
            self._put(memory.AD_VALUES + 2 * channel, raw - reference)

    def _ad(self) -> tuple[int, ...]:
        return tuple(
            self._signed(memory.AD_VALUES + 2 * channel) for channel in range(memory.AD_CHANNELS)
        )

    # ---- memory ----

    def _word(self, address: int) -> int:
        return int.from_bytes(self.ram[address : address + 2], 'little')

    def _signed(self, address: int) -> int:
        return int.from_bytes(self.ram[address : address + 2], 'little', signed=True)

    def _put(self, address: int, value: int) -> None:
        self.ram[address : address + 2] = (value & 0xFFFF).to_bytes(2, 'little')


def _require(accepted: bool) -> None:
    if not accepted:
        raise _NotAcceptedError
