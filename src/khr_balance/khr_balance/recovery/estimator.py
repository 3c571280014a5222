"""Estimate the centre of mass and the capture point over the soles from gyro and foot forces."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians
from typing import NamedTuple

from khr_balance.feedback import finite, finite_forces
from khr_balance.recovery.parameters import RecoveryParameters

LOADED = 5.0  # N on both feet from which on their centre of pressure counts


class Estimate(NamedTuple):
    """Estimated state in the sagittal plane, ahead of the middle of the soles.

    Attributes:
        com: centre of mass x, m.
        capture_point: x + x'/omega, m, where x' is the height of the centre times the pitch rate.
        rate: pitch rate, rad/s.
    """

    com: float
    capture_point: float
    rate: float


class CaptureEstimator:
    """Integrate the gyro; while the robot is quiet, follow the centre of pressure.

    A robot at rest has its centre of mass above its centre of pressure. The force sensors lag by
    0.5 s, too late for a fall; the gyro drifts, which the forces correct at rest.
    """

    def __init__(self, parameters: RecoveryParameters) -> None:
        self.parameters = parameters
        self._com = 0.0
        self._quiet = 0.0  # s

    def configure(self, parameters: RecoveryParameters) -> None:
        """Use changed parameters from the next sample on; the state is kept."""
        self.parameters = parameters

    def update(
        self, pitch_rate: float, foot_forces: Sequence[float], moving: bool = False
    ) -> Estimate:
        """Return the estimate for a sample.

        Args:
            pitch_rate: reading of the gyro, rad/s, forward positive.
            foot_forces: normal forces on l_toe, l_heel, r_toe, r_heel, N.
            moving: whether the reference moves. The estimate then is the deviation of the body
                from the planned motion, and decays with ``moving_time_constant``.

        Raises:
            KhrError: if a value is not finite.
        """
        own = self.parameters
        rate = finite('pitch_rate', pitch_rate, 'rad/s')
        l_toe, l_heel, r_toe, r_heel = finite_forces(foot_forces)
        load = l_toe + l_heel + r_toe + r_heel
        speed = own.height * rate
        tips = abs(self._com + speed / own.growth_rate) > own.tipping_distance
        self._com += (own.tipping_height if tips else own.height) * rate * own.control_period
        still = abs(rate) < radians(own.quiet_rate_deg)
        self._quiet = self._quiet + own.control_period if still else 0.0
        if moving:
            self._com -= self._com * own.control_period / own.moving_time_constant
        elif self._quiet > own.quiet_time and load > LOADED:
            pressure = own.sole_distance * (l_toe + r_toe - l_heel - r_heel) / load
            self._com += (pressure - self._com) * own.control_period / own.quiet_time_constant
        com = self._com + own.gyro_lag * speed
        return Estimate(com, com + speed / own.growth_rate, rate)
