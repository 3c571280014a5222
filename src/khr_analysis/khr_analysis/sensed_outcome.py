"""The outcome of a run by the sensors alone: whether the robot fell."""

from __future__ import annotations

from math import hypot, radians

from khr_analysis.outcome import MonitorParameters, SensedOutcome, vibration_of
from khr_common.block import Signals
from khr_common.interfaces import FOOT_FORCES, GYRO


class SensedMonitor:
    """Judge a run by the gyro and the foot forces.

    A fall is a fast rotation followed by a loss of the load on both feet. A robot that is lifted
    by hand loses the load without a fast rotation; one that stumbles regains the load.
    """

    def __init__(self, parameters: MonitorParameters) -> None:
        self.configure(parameters)
        self._turned = float('-inf')  # when it last turned fast, s
        self._loaded = 0.0  # when a foot last carried the robot, s
        self._fell: float | None = None
        self._fastest = 0.0
        self._vibration = vibration_of(parameters)

    def configure(self, parameters: MonitorParameters) -> None:
        """Take changed parameters."""
        self.parameters = parameters

    def update(self, stamp_ns: int, signals: Signals) -> SensedOutcome:
        """Return the outcome so far.

        Args:
            stamp_ns: of the sample, in the time of the run.
            signals: of ``SENSED``.
        """
        own = self.parameters
        time = stamp_ns / 1e9
        rate = hypot(*signals[GYRO])
        self._fastest = max(self._fastest, rate)
        self._vibration.add(time, signals[GYRO][1])
        if rate > radians(own.fall_rate_deg):
            self._turned = time
        if sum(signals[topic][2] for topic in FOOT_FORCES) > own.load_threshold:
            self._loaded = time
        # The sensors lag: the forces go while it turns, or after.
        if (
            self._fell is None
            and time - self._loaded >= own.fall_time
            and self._turned >= self._loaded - own.fall_memory
        ):
            self._fell = time
        return SensedOutcome(
            'fell' if self._fell is not None else 'upright',
            time,
            self._fell,
            self._fastest,
            self._vibration.rms,
        )
