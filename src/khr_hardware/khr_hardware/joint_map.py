"""The joint map: servo, sign and zero of each joint, and the sensors on the AD ports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from math import degrees, isfinite, radians
from pathlib import Path
from typing import Any

from khr_common.errors import KhrError
from khr_common.interfaces import JOINTS, REGIONS
from khr_common.published import AD_STEP
from khr_common.text.quoting import named, quoted
from khr_common.text.strict_yaml import read_file, read_yaml
from khr_hardware.protocol.memory import AD_CHANNELS, COUNT_DEG, ICS_NUMBERS

COUNT = radians(COUNT_DEG)
EDGE = 1e-6  # rad, tolerance for rounding at a limit
MAPS, DEFAULT = files('khr_hardware') / 'maps', 'khr3hv'


@dataclass(frozen=True)
class ServoWiring:
    """A servo and its joint."""

    ics: int  # ICS number of the servo
    sign: int  # 1 if the counts increase with the joint angle, -1 if they decrease
    trim: int  # expected in the board, counts
    zero: int  # position at the joint angle 0, counts, without trim
    limits: tuple[float, float]  # of the joint, rad

    def counts(self, angle: float) -> int:
        """Return the position nearest to an angle in rad, rounded as the simulated board does."""
        return self.zero + self.sign * round(angle / COUNT)

    def angle(self, counts: int) -> float:
        """Return the angle in rad of a position."""
        return self.sign * (counts - self.zero) * COUNT


@dataclass(frozen=True)
class GyroWiring:
    """The pitch gyro."""

    channel: int  # AD port
    sign: int  # 1 if the voltage increases with a forward pitch rate, -1 if it decreases
    volts_per_rad_s: float  # at the AD port, including the gain of an amplifier

    @property
    def step(self) -> float:
        """Return the pitch rate of one AD step, rad/s."""
        return self.sign * AD_STEP / self.volts_per_rad_s


@dataclass(frozen=True)
class ForceWiring:
    """A force sensor: AD port and force per voltage, N/V."""

    channel: int
    newtons_per_volt: float


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
            KhrError: if it is no YAML.
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
            servos = {joint: _servo(found[joint], f'{named(file)}: {joint}') for joint in JOINTS}
        gyro = None if parts['gyro'] is None else _gyro(parts['gyro'], f'{named(file)}: gyro')
        forces = {}
        if parts['forces'] is not None:
            given = _mapping(parts['forces'], tuple(REGIONS), f'{named(file)}: forces')
            forces = {name: _force(given[name], f'{named(file)}: {name}') for name in REGIONS}
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


def _servo(data: Any, where: str) -> ServoWiring:
    values = _mapping(data, ('ics', 'sign', 'trim', 'zero', 'min_deg', 'max_deg'), where)
    low, high = (_number(values, key, -180.0, 180.0, where) for key in ('min_deg', 'max_deg'))
    if low >= high:
        raise KhrError(f'{where}.max_deg: {high:g} is not accepted; accepted: above min_deg')
    return ServoWiring(
        _integer(values, 'ics', 0, ICS_NUMBERS - 1, where),
        _sign(values, where),
        _integer(values, 'trim', -4000, 4000, where),
        _integer(values, 'zero', 3500, 11500, where),
        (radians(low), radians(high)),
    )


def _gyro(data: Any, where: str) -> GyroWiring:
    values = _mapping(data, ('channel', 'sign', 'volts_per_rad_s'), where)
    return GyroWiring(
        _integer(values, 'channel', 1, AD_CHANNELS - 1, where),
        _sign(values, where),
        _number(values, 'volts_per_rad_s', 0.001, 10.0, where),
    )


def _force(data: Any, where: str) -> ForceWiring:
    values = _mapping(data, ('channel', 'newtons_per_volt'), where)
    return ForceWiring(
        _integer(values, 'channel', 1, AD_CHANNELS - 1, where),
        _number(values, 'newtons_per_volt', 0.1, 1000.0, where),
    )


def _mapping(data: Any, keys: Sequence[str], where: str) -> dict[str, Any]:
    if not isinstance(data, dict) or set(data) != set(keys):
        raise _refusal(where, data, f'a mapping of {", ".join(keys)}')
    return data


def _integer(values: dict[str, Any], key: str, low: int, high: int, where: str) -> int:
    value = values[key]
    if type(value) is not int or not low <= value <= high:
        raise _refusal(f'{where}.{key}', value, f'integer in [{low}, {high}]')
    return value


def _number(values: dict[str, Any], key: str, low: float, high: float, where: str) -> float:
    value = values[key]
    if type(value) not in (int, float) or not isfinite(value) or not low <= value <= high:
        raise _refusal(f'{where}.{key}', value, f'float in [{low:g}, {high:g}]')
    return float(value)


def _sign(values: dict[str, Any], where: str) -> int:
    sign = values['sign']
    if type(sign) is not int or sign not in (-1, 1):
        raise _refusal(f'{where}.sign', sign, '1 | -1')
    return sign


def _refusal(where: str, value: Any, accepted: str) -> KhrError:
    return KhrError(f'{where}: {quoted(value)} is not accepted; accepted: {accepted}')


def _check_once(numbers: Sequence[int], where: str) -> None:
    twice = sorted({each for each in numbers if numbers.count(each) > 1})
    if twice:
        raise KhrError(f'{where} {twice[0]}: used twice; accepted: each once')
