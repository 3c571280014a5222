"""The pitch gyro and its zero, which is its voltage while the robot is at rest."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from statistics import mean

from khr_common.errors import KhrError
from khr_hardware.joint_map import GyroWiring
from khr_hardware.protocol.memory import AD_TOP

REST_SAMPLES = 20  # readings averaged for the voltage at rest
REST_SPREAD = 3  # AD steps between the smallest and largest of these readings


def rest_level(readings: Sequence[int]) -> int:
    """Return the AD reading of the gyro at rest, in steps, without subtracting AD_ref.

    Raises:
        KhrError: if there are too few readings, the robot moves, or the port is not connected.
    """
    if len(readings) < REST_SAMPLES:
        raise KhrError(
            f'gyro: it was read {len(readings)} times; accepted: {REST_SAMPLES}; try again'
        )
    if max(readings) - min(readings) > REST_SPREAD:
        raise KhrError(
            f'gyro: it reads {min(readings)} to {max(readings)} steps; accepted: a robot at rest'
        )
    level = round(mean(readings))
    if not 0 < level < AD_TOP:
        raise KhrError(
            f'gyro: {level} steps at rest are not accepted; accepted: 1 to {AD_TOP - 1}, of a gyro '
            'that is connected'
        )
    return level


class RestingGyro:
    """Read the pitch rate relative to the gyro's voltage at rest.

    AD_ref is no such zero: gyros differ, and another run or program may have shifted it.

    Attributes:
        reference: AD_ref in the board, steps.
        level: conversion at rest, steps; AD_ref until it is taken.
    """

    def __init__(self, wiring: GyroWiring) -> None:
        self.wiring = wiring
        self._readings: deque[int] = deque(maxlen=REST_SAMPLES)
        self.reference = self.level = self._converted = 0

    def connect(self, references: Sequence[int]) -> None:
        """Store the AD references read from the board, and drop the readings."""
        self.reference = self.level = self._converted = references[self.wiring.channel]
        self._readings.clear()

    def update(self, ad: Sequence[int], idle: bool) -> None:
        """Store an AD reading, of a robot that may be at rest if it is idle."""
        self._converted = ad[self.wiring.channel] + self.reference
        if idle:
            self._readings.append(self._converted)

    def take_level(self, references: Sequence[int]) -> None:
        """Take the level at rest from the last readings.

        Args:
            references: AD references in the board; if AD_ref changed, the readings do not count.

        Raises:
            KhrError: if the robot is not at rest.
        """
        if references[self.wiring.channel] != self.reference:
            self.connect(references)
        self.level = rest_level(self._readings)
        self._readings.clear()

    @property
    def pitch_rate(self) -> float:
        """Return the pitch rate, rad/s."""
        return (self._converted - self.level) * self.wiring.step
