"""The sensors of the board, as blocks: gyro and force sensors, with its AD converter.

The gyro KRG-4 measures one axis, on the robot pitch, ``y`` of ``imu_link``. Roll and yaw are
simulated by two more sensors of the same kind, which the real robot lacks and no controller reads.
The sensitivity is published (5.2); there is no public data sheet of the KRG-4. As the Murata
ENC-03R has the same sensitivity, its range of 300 deg/s is assumed. The bandwidth is calibrated;
noise and offset are assumed.

The thesis gives two resistive force sensors under toe and heel of each foot and no data; range,
noise, resolution and time constant are assumed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite, radians, tau

from khr_common import KhrError, fixed, parameter, sample_period
from khr_common import interfaces as topics
from khr_common.block import CoreBlock, NodeSpec, Numbers, Signals
from khr_common.published import AD_STEP
from khr_common.signals import LowPass, generator
from khr_models.gyro_circuit.baseband import Baseband
from khr_models.gyro_circuit.circuit import KRG4, PACKAGED_SENSITIVITY

AD_HALF_RANGE = 512  # steps between the voltage at rest, taken at mid-range, and the rails


@dataclass(frozen=True)
class GyroParameters:
    """The parameter table of the gyro."""

    model: str = parameter(
        'packaged',
        'Dynamics of the sensor: "ideal" reports the true rate, "packaged" is a '
        'first-order low-pass, "circuit" the vibratory sensor down to its circuit. Sensitivity, '
        'offset, noise, range and converter apply to the last two.',
        choices=('ideal', 'packaged', 'circuit'),
    )
    sensitivity: float = parameter(
        0.67,
        'Sensitivity of this sensor. The board assumes the nominal 0.67, so that '
        'another value is a scale error.',
        '[0.01, 10] mV per deg/s',
    )
    bandwidth: float = parameter(9.568, 'Corner of the low-pass.', '[0.05, 500] Hz')
    noise: float = parameter(
        0.01, 'Standard deviation of the white noise of a sample.', '[0, 1] rad/s'
    )
    zero_offset: float = parameter(
        0.0, 'Output at rest, after the board has subtracted its reference.', '[-1, 1] rad/s'
    )
    saturation: float = parameter(
        5.236, 'Largest rate that the sensor can measure.', '[0.1, 60] rad/s'
    )
    adc: bool = parameter(
        True,
        "Round the output to the steps of the board's 10-bit converter over 5 V: 7.3 deg/s "
        'at the nominal sensitivity.',
    )
    seed: int = fixed(0, 'Seed of the noise.', '[0, inf]')
    control_period: float = sample_period()


class Gyro:
    """Convert the true mean rate of each control period to the reading of the board."""

    def __init__(self, parameters: GyroParameters) -> None:
        period = parameters.control_period
        self._low_pass = LowPass(3, period, 0.0)
        self._circuits = [Baseband(period) for _ in range(3)]
        self._noise = generator(parameters.seed, 'gyro')
        self.configure(parameters)

    def configure(self, parameters: GyroParameters) -> None:
        """Apply changed parameters from the next sample on; the models keep their state."""
        self.parameters = parameters
        ideal = parameters.model == 'ideal'
        self._low_pass.configure(0.0 if ideal else 1.0 / (tau * parameters.bandwidth))
        for circuit in self._circuits:
            circuit.configure(replace(KRG4, bandwidth=parameters.bandwidth))

    def update(self, angular_rate: Sequence[float]) -> tuple[float, float, float]:
        """Return the readings of the board at the end of a control period.

        Args:
            angular_rate: true rates about x, y, z of ``imu_link``, rad/s; means over the period.

        Returns:
            Rates about x, y, z in rad/s.

        Raises:
            KhrError: if the rates are not three finite numbers.
        """
        if len(angular_rate) != 3 or not all(map(isfinite, angular_rate)):
            raise KhrError.refused('angular_rate', angular_rate, 'three finite rates in rad/s')
        # Always drawn, so that the sequence depends on the seed alone.
        noise = self._noise.standard_normal(3).tolist()
        sensed = self._sense(angular_rate)
        x, y, z = sensed if self.parameters.model == 'ideal' else map(self._read, sensed, noise)
        return x, y, z

    def _sense(self, rate: Sequence[float]) -> list[float]:
        """Return the outputs of the three sensing elements, in rad/s."""
        if self.parameters.model != 'circuit':
            return self._low_pass.update(rate)
        return [circuit.update(each) for circuit, each in zip(self._circuits, rate, strict=True)]

    def _read(self, sensed: float, noise: float) -> float:
        """Apply noise, range, scale, offset and AD converter to one sensing element."""
        own, limit = self.parameters, self.parameters.saturation
        scale = own.sensitivity / 1000.0 / radians(1.0)
        voltage = (
            scale * min(max(sensed + own.noise * noise, -limit), limit)
            + PACKAGED_SENSITIVITY * own.zero_offset
        )
        if own.adc:
            steps = min(max(round(voltage / AD_STEP), -AD_HALF_RANGE), AD_HALF_RANGE - 1)
            voltage = steps * AD_STEP
        return voltage / PACKAGED_SENSITIVITY


class GyroBlock(CoreBlock[GyroParameters, Gyro]):
    """Convert the true rate of the torso to the gyro reading of the board (REP 145), rates only."""

    subscribes = (topics.TRUE_RATE,)
    publishes = (topics.GYRO,)

    def __init__(self, parameters: GyroParameters) -> None:
        super().__init__(parameters, Gyro(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the rates about x, y, z."""
        return (self.core.update(signals[topics.TRUE_RATE]),)


@dataclass(frozen=True)
class FootForceParameters:
    """The parameter table of the foot-force sensors."""

    saturation: float = parameter(
        25.0, 'Largest force that a sensor can measure; the robot weighs 14.7 N.', '[1, 200] N'
    )
    noise: float = parameter(
        0.05, 'Standard deviation of the white noise of a sample.', '[0, 5] N'
    )
    resolution: float = parameter(
        0.025,
        'Resolution of the reading; 0 for none. The default is a thousandth of the range, as '
        'with the 10-bit converter of the board.',
        '[0, 5] N',
    )
    time_constant: float = parameter(0.5, 'Time constant of the low-pass; 0 for none.', '[0, 1] s')
    seed: int = fixed(0, 'Seed of the noise.', '[0, inf]')
    control_period: float = sample_period()


class FootForce:
    """Convert the true mean contact forces of each control period to four readings."""

    def __init__(self, parameters: FootForceParameters) -> None:
        self._low_pass = LowPass(4, parameters.control_period, parameters.time_constant)
        self._noise = generator(parameters.seed, 'foot_force')
        self.configure(parameters)

    def configure(self, parameters: FootForceParameters) -> None:
        """Apply changed parameters from the next sample on and keep the state."""
        self.parameters = parameters
        self._low_pass.configure(parameters.time_constant)

    def update(self, contact_force: Sequence[Sequence[float]]) -> tuple[float, ...]:
        """Return the readings of the sensors, in N, from 0 to the saturation.

        Args:
            contact_force: (4, 3), true forces on l_toe, l_heel, r_toe and r_heel, each in its own
                frame with z normal to the sole, N; means over the period.

        Returns:
            Four normal forces in the same order, each along the normal of its own sole.

        Raises:
            KhrError: if the forces are not (4, 3) finite numbers.
        """
        if [*map(len, contact_force)] != [3] * 4 or not isfinite(sum(map(sum, contact_force))):
            raise KhrError.refused('contact_force', contact_force, '(4, 3) finite forces in N')
        own = self.parameters
        # Always drawn, so that the sequence depends on the seed alone.
        noise = self._noise.standard_normal(4).tolist()
        normal = self._low_pass.update([force[2] for force in contact_force])
        readings = [each + own.noise * error for each, error in zip(normal, noise, strict=True)]
        if own.resolution > 0.0:
            readings = [round(each / own.resolution) * own.resolution for each in readings]
        return tuple([min(max(each, 0.0), own.saturation) for each in readings])


class FootForceBlock(CoreBlock[FootForceParameters, FootForce]):
    """Convert the true contact forces to sensor readings, in the same frames."""

    subscribes = topics.TRUE_FORCES
    publishes = topics.FOOT_FORCES

    def __init__(self, parameters: FootForceParameters) -> None:
        super().__init__(parameters, FootForce(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the normal force of each sensor."""
        normal = self.core.update([signals[topic] for topic in topics.TRUE_FORCES])
        return tuple([(0.0, 0.0, force) for force in normal])


GYRO = NodeSpec('gyro', 'khr_sim', GyroParameters, GyroBlock)
FOOT_FORCE = NodeSpec('foot_force', 'khr_sim', FootForceParameters, FootForceBlock)
