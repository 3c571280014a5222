"""The joint map: servo, sign and zero of each joint, and the sensors on the AD ports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.resources import files
from math import degrees, isfinite, radians
from pathlib import Path
from typing import Any, TypeVar

from khr_common import ParameterError, build, parameter, specifications
from khr_common.errors import KhrError, named
from khr_common.interfaces import JOINTS, REGIONS
from khr_common.published import AD_STEP
from khr_common.strict_yaml import read_file, read_yaml
from khr_hardware.protocol.memory import AD_CHANNELS, COUNT_DEG, ICS_NUMBERS

COUNT = radians(COUNT_DEG)
EDGE = 1e-6  # rad, tolerance for rounding at a limit
MAPS, DEFAULT = files('khr_hardware') / 'maps', 'khr3hv'
Table = TypeVar('Table')


@dataclass(frozen=True)
class ServoWiring:
    """A servo and its joint."""

    ics: int = parameter(0, 'ICS number of the servo.', f'[0, {ICS_NUMBERS - 1}]')
    sign: int = parameter(1, '1 if the counts increase with the joint angle, else -1.')
    trim: int = parameter(0, 'Expected in the board.', '[-4000, 4000] counts')
    zero: int = parameter(
        7500, 'Position at the joint angle 0, without trim.', '[3500, 11500] counts'
    )
    min_deg: float = parameter(-180.0, 'Lower limit of the joint.', '[-180, 180] deg')
    max_deg: float = parameter(180.0, 'Upper limit of the joint.', '[-180, 180] deg')

    def __post_init__(self) -> None:
        _check_sign(self.sign)
        if self.min_deg >= self.max_deg:
            raise ParameterError(
                f'max_deg: {self.max_deg:g} is not accepted; accepted: above min_deg'
            )

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Return the limits of the joint, rad."""
        return radians(self.min_deg), radians(self.max_deg)

    def counts(self, angle: float) -> int:
        """Return the position nearest to an angle in rad, rounded as the simulated board does."""
        return self.zero + self.sign * round(angle / COUNT)

    def angle(self, counts: int) -> float:
        """Return the angle in rad of a position."""
        return self.sign * (counts - self.zero) * COUNT

    def step_towards(self, goal: float, last: float, most: float) -> float:
        """Return the next target of the joint: within its limits, at most a step from the last.

        A joint that started beyond a limit returns as slowly as its goal does, never further out.

        Args:
            goal: rad; one that is not finite keeps the last target.
            last: last target, rad.
            most: largest step, rad.
        """
        if not isfinite(goal):
            return last
        low, high = self.limits
        return min(max(goal, last - most, min(low, last)), last + most, max(high, last))


@dataclass(frozen=True)
class GyroWiring:
    """The pitch gyro."""

    channel: int = parameter(1, 'AD port.', f'[1, {AD_CHANNELS - 1}]')
    sign: int = parameter(1, '1 if the voltage increases with a forward pitch rate, else -1.')
    volts_per_rad_s: float = parameter(
        1.0, 'At the AD port, including the gain of an amplifier.', '[0.001, 10]'
    )

    def __post_init__(self) -> None:
        _check_sign(self.sign)

    @property
    def step(self) -> float:
        """Return the pitch rate of one AD step, rad/s."""
        return self.sign * AD_STEP / self.volts_per_rad_s


@dataclass(frozen=True)
class ForceWiring:
    """A force sensor."""

    channel: int = parameter(1, 'AD port.', f'[1, {AD_CHANNELS - 1}]')
    newtons_per_volt: float = parameter(1.0, 'Force per voltage.', '[0.1, 1000] N/V')


@dataclass(frozen=True)
class JointMap:
    """The wiring of the robot."""

    servos: Mapping[str, ServoWiring]  # of all 17 joints, in their order
    gyro: GyroWiring | None  # None without a gyro
    # of the four regions of the feet; empty without force sensors
    forces: Mapping[str, ForceWiring]

    @classmethod
    def load(cls, path: str = '') -> JointMap:
        """Read a map from a file, or a map of this package.

        Args:
            path: of a file, or the name of a map of this package; by default the KHR-3HV's.

        Raises:
            KhrError: if it is not accepted.
        """
        name = path or DEFAULT
        shipped = MAPS / f'{name}.yaml'
        if '/' not in name and shipped.is_file():
            return cls.parse(read_yaml(shipped.read_text(encoding='utf-8'), name), name)
        return cls.parse(read_yaml(read_file(Path(path)), path), path)

    @classmethod
    def parse(cls, data: Any, file: str) -> JointMap:
        """Check a map given as plain data; ``servos: khr3hv`` takes the servos of the default map.

        Raises:
            KhrError: if a key is missing or unknown, or a value is out of range or used twice.
        """
        parts = _mapping(data, ('servos', 'gyro', 'forces'), named(file))
        servos: Mapping[str, ServoWiring] = {}
        if parts['servos'] == DEFAULT:
            servos = cls.load().servos
        else:
            found = _mapping(parts['servos'], JOINTS, f'{named(file)}: servos')
            servos = {
                joint: _read(ServoWiring, found[joint], f'{named(file)}: {joint}')
                for joint in JOINTS
            }
        gyro = (
            None
            if parts['gyro'] is None
            else _read(GyroWiring, parts['gyro'], f'{named(file)}: gyro')
        )
        forces = {}
        if parts['forces'] is not None:
            given = _mapping(parts['forces'], tuple(REGIONS), f'{named(file)}: forces')
            forces = {
                name: _read(ForceWiring, given[name], f'{named(file)}: {name}') for name in REGIONS
            }
        channels = [force.channel for force in forces.values()] + ([gyro.channel] if gyro else [])
        _check_once([servo.ics for servo in servos.values()], f'{named(file)}: ICS number')
        _check_once(channels, f'{named(file)}: AD channel')
        return cls(servos, gyro, forces)

    @property
    def numbers(self) -> list[int]:
        """Return the ICS numbers in the order of the joints."""
        return [servo.ics for servo in self.servos.values()]

    @property
    def trims(self) -> dict[int, int]:
        """Return the expected trims by ICS number."""
        return {servo.ics: servo.trim for servo in self.servos.values()}

    def joint_of(self, ics: int) -> str:
        """Return the joint of an ICS number; empty if it is not in the map."""
        return next((joint for joint, servo in self.servos.items() if servo.ics == ics), '')

    def positions(self, angles: Sequence[float]) -> dict[int, int]:
        """Return the positions (counts by ICS number) nearest to 17 joint angles in rad."""
        return {
            servo.ics: servo.counts(angle)
            for servo, angle in zip(self.servos.values(), angles, strict=True)
        }

    def angles(self, positions: Mapping[int, int]) -> list[float]:
        """Return the 17 joint angles in rad for positions (counts by ICS number)."""
        return [servo.angle(positions[servo.ics]) for servo in self.servos.values()]

    def outside(self, angles: Sequence[float], margin: float = EDGE) -> list[str]:
        """Return a message for each of 17 angles (rad) beyond its limits by more than a margin."""
        return [
            f'{joint}: {degrees(angle):.1f} deg is not accepted; accepted: '
            f'{degrees(servo.limits[0]):.0f} to {degrees(servo.limits[1]):.0f} deg'
            for (joint, servo), angle in zip(self.servos.items(), angles, strict=True)
            if not servo.limits[0] - margin <= angle <= servo.limits[1] + margin
        ]

    def pitch_rate(self, ad: Sequence[int]) -> float:
        """Return the pitch rate in rad/s from the AD readings; 0 without a gyro."""
        return ad[self.gyro.channel] * self.gyro.step if self.gyro else 0.0

    def normal_forces(self, ad: Sequence[int]) -> dict[str, float]:
        """Return the forces in N, by region, from the AD readings."""
        return {
            region: ad[force.channel] * AD_STEP * force.newtons_per_volt
            for region, force in self.forces.items()
        }


def _read(table: type[Table], data: Any, where: str) -> Table:
    """Build a table of which every value is given; integers for floats are accepted."""
    known = specifications(table)
    values = {
        key: float(value) if known[key].kind is float and type(value) is int else value
        for key, value in _mapping(data, [*known], where).items()
    }
    try:
        return build(table, values)
    except ParameterError as error:
        raise KhrError(f'{where}.{error}') from error


def _mapping(data: Any, keys: Sequence[str], where: str) -> dict[str, Any]:
    if not isinstance(data, dict) or set(data) != set(keys):
        raise KhrError.refused(where, data, f'a mapping of {", ".join(keys)}')
    return data


def _check_sign(sign: int) -> None:
    if sign not in (-1, 1):
        raise ParameterError(f'sign: {sign} is not accepted; accepted: 1 | -1')


def _check_once(numbers: Sequence[int], where: str) -> None:
    twice = sorted({each for each in numbers if numbers.count(each) > 1})
    if twice:
        raise KhrError(f'{where} {twice[0]}: used twice; accepted: each once')
