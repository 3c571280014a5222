"""The sensors as blocks of the node graph."""

from __future__ import annotations

from khr_common.block import CoreBlock, Numbers, Signals
from khr_common.interfaces import FOOT_FORCES, GYRO, TRUE_FORCES, TRUE_RATE
from khr_sim.sensors.foot_force import FootForce, FootForceParameters
from khr_sim.sensors.gyro import Gyro, GyroParameters


class GyroBlock(CoreBlock[GyroParameters, Gyro]):
    """Convert the true rate of the torso to the gyro reading of the board (REP 145), rates only."""

    subscribes = (TRUE_RATE,)
    publishes = (GYRO,)

    def __init__(self, parameters: GyroParameters) -> None:
        super().__init__(parameters, Gyro(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the rates about x, y, z."""
        return (self.core.update(signals[TRUE_RATE]),)


class FootForceBlock(CoreBlock[FootForceParameters, FootForce]):
    """Convert the true contact forces to sensor readings, in the same frames."""

    subscribes = TRUE_FORCES
    publishes = FOOT_FORCES

    def __init__(self, parameters: FootForceParameters) -> None:
        super().__init__(parameters, FootForce(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the normal force of each sensor."""
        normal = self.core.update([signals[topic] for topic in TRUE_FORCES])
        return tuple([(0.0, 0.0, force) for force in normal])
