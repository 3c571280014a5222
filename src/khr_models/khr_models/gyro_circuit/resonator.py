"""A damped mass on a spring: m x'' + b x' + k x = F, the drive and the sense axis alike."""

from __future__ import annotations

import math
from dataclasses import dataclass

from khr_common.checks import between, positive


@dataclass(frozen=True)
class Resonator:
    """Mass (kg), damping (N s/m) and stiffness (N/m) of one axis; it must be underdamped.

    Raises:
        KhrError: if one of them is not positive or the damping is not below critical.
    """

    mass: float
    damping: float
    stiffness: float

    def __post_init__(self) -> None:
        positive('mass', self.mass, 'kg')
        positive('stiffness', self.stiffness, 'N/m')
        critical = 2.0 * math.sqrt(self.stiffness * self.mass)
        between('damping', self.damping, 0.0, critical, 'N s/m')

    @property
    def natural_frequency(self) -> float:
        """Undamped natural frequency, rad/s: where the velocity is largest and in phase."""
        return math.sqrt(self.stiffness / self.mass)

    @property
    def quality(self) -> float:
        """Quality factor."""
        return math.sqrt(self.stiffness * self.mass) / self.damping

    @property
    def pole(self) -> complex:
        """The pole of positive frequency, rad/s; the other one is its conjugate."""
        decay = self.damping / (2.0 * self.mass)
        return complex(-decay, math.sqrt(self.natural_frequency**2 - decay**2))

    def response(self, s: complex) -> complex:
        """Return displacement over force at the complex frequency ``s`` (rad/s), m/N."""
        return 1.0 / (self.mass * s * s + self.damping * s + self.stiffness)
