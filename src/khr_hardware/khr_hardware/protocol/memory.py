"""The memory of the RCB-4HV: addresses, configuration word, servo records, mixing.

Sources: the maker's command and firmware references; where they contradict themselves, the
public clients. docs/hardware.md lists the assumptions that only a board can confirm.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass, replace
from struct import Struct

from khr_common.errors import KhrError
from khr_common.published import CONTROL_PERIODS

RAM_SIZE = 0x0490
ROM_SIZE = 0x40000
CONFIG = 0x0000
AD_REFERENCES, AD_VALUES, AD_CHANNELS = 0x000C, 0x0022, 11
AD_TOP = 1023  # largest conversion of an AD channel, steps
ICS_TABLE, ICS_NUMBERS, UNASSIGNED = 0x0044, 35, 0xFFFF
RECORDS, RECORD_SIZE = 0x0090, 20
VERSION = b'CB-4 V1.0      090715          \xc7'

FREE, HOLD = 0x8000, 0x7FFF
CENTRE, LOWEST, HIGHEST = 7500, 3500, 11500  # positions of a servo
COUNT_DEG = 0.03375
BATTERY_VOLTS = 25.0 / 1024  # per AD step of channel 0
BAUD_RATES = (115_200, 625_000, 1_250_000)  # in the order of their code in the configuration

# Offsets in a servo record.
TYPE, ID, TRIM, MEASURED, REFERENCE, SPEED, END, STEPS_LEFT, WIDTH = 0, 1, 2, 4, 6, 8, 9, 11, 12
MIXINGS = (14, 17)  # source, ratio of each
NO_SOURCE = 0xFFFF
LARGEST_RATIO = 127


@dataclass(frozen=True)
class Config:
    """The configuration word at 0x0000, as its bits."""

    word: int

    @property
    def ics(self) -> bool:
        """Return whether the board talks to its servos."""
        return bool(self.word & 0x0001)

    @property
    def program(self) -> bool:
        """Return whether the ROM program runs."""
        return bool(self.word & 0x0002)

    @property
    def jumps(self) -> bool:
        """Return whether the vector jumps are on."""
        return bool(self.word & 0x0008)

    @property
    def cycle(self) -> float:
        """Return the output cycle, s."""
        return CONTROL_PERIODS[self.word >> 4 & 3]

    @property
    def baud(self) -> int | None:
        """Return the rate of the serial line; None for the undefined code."""
        code = self.word >> 6 & 3
        return BAUD_RATES[code] if code < len(BAUD_RATES) else None

    @property
    def ics_code(self) -> int:
        """Return the code of the rate on the servos' bus."""
        return self.word >> 13 & 3

    def quiet(self) -> Config:
        """Return the word with ROM program, unsolicited messages and jumps off, servo bus on."""
        return replace(self, word=self.word & ~0x000E | 0x0001)

    def without_led(self) -> Config:
        """Return the word with the LED off."""
        return replace(self, word=self.word & ~0x8000)

    def with_cycle(self, cycle: float) -> Config:
        """Return the word with another output cycle.

        Raises:
            KhrError: if the board has no such cycle.
        """
        if cycle not in CONTROL_PERIODS:
            raise KhrError(
                f'output cycle: {cycle:g} s is not accepted; accepted: '
                f'{" | ".join(f"{each:g}" for each in CONTROL_PERIODS)} s'
            )
        return replace(self, word=self.word & ~0x0030 | CONTROL_PERIODS.index(cycle) << 4)


@dataclass(frozen=True)
class Mixing:
    """One of the two inputs that the board adds to a servo's position in each output cycle."""

    source: int = NO_SOURCE  # the word of the record: RAM address, or ICS number and offset
    ratio: int = 0  # byte of the record: sign in bit 7, factor in the others

    @classmethod
    def of_ad(cls, channel: int, factor: int) -> Mixing:
        """Return ``factor`` counts per step of an AD channel; negative factors set the sign bit."""
        if not 0 <= channel < AD_CHANNELS:
            raise KhrError.refused('AD channel', channel, f'0 to {AD_CHANNELS - 1}')
        if type(factor) is not int or abs(factor) > LARGEST_RATIO:
            raise KhrError.refused(
                'mixing ratio', factor, f'an integer from -{LARGEST_RATIO} to {LARGEST_RATIO}'
            )
        return cls(0x4000 | AD_VALUES + 2 * channel, (0x80 if factor < 0 else 0) | abs(factor))

    @property
    def active(self) -> bool:
        """Return whether the mixing has a source and a nonzero factor."""
        return self.source != NO_SOURCE and self.factor != 0

    @property
    def factor(self) -> int:
        """Return the signed factor."""
        return -(self.ratio & 0x7F) if self.ratio & 0x80 else self.ratio & 0x7F

    @property
    def ad_channel(self) -> int | None:
        """Return the AD channel of the source; None for another source."""
        steps, odd = divmod((self.source & 0x07FF) - AD_VALUES, 2)
        is_word = self.source & 0xC000 == 0x4000
        return steps if is_word and not odd and 0 <= steps < AD_CHANNELS else None

    def encode(self) -> bytes:
        """Return the three bytes of the record."""
        return self.source.to_bytes(2, 'little') + bytes((self.ratio,))


_RECORD = Struct('<BBhHHBHBHHBHB')  # in the order of the fields below


@dataclass(frozen=True)
class ServoRecord:
    """The 20-byte record of a servo: settings and state."""

    type: int
    ics_id: int
    trim: int
    measured: int
    reference: int
    speed: int
    end: int
    steps_left: int
    width: int
    mixings: tuple[Mixing, Mixing]

    @classmethod
    def decode(cls, data: bytes) -> ServoRecord:
        """Decode a record."""
        *fields, source, ratio, source_2, ratio_2 = _RECORD.unpack(data)
        fields.append((Mixing(source, ratio), Mixing(source_2, ratio_2)))
        return cls(*fields)

    def encode(self) -> bytes:
        """Return the 20 bytes of the record."""
        *fields, (one, two) = astuple(self)
        return _RECORD.pack(*fields, *one, *two)


def record_address(ics: int) -> int:
    """Return the address of the record of an ICS number."""
    return RECORDS + RECORD_SIZE * check_ics(ics)


def check_ics(ics: int) -> int:
    """Check and return an ICS number: 2 ID on SIO1 to 4, 2 ID + 1 on SIO5 to 8."""
    if not 0 <= ics < ICS_NUMBERS:
        raise KhrError.refused('ICS number', ics, f'0 to {ICS_NUMBERS - 1}')
    return ics
