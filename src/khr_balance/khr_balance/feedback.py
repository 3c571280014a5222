"""The proportional feedback of the controllers, with gains in units of the controller board.

In every output period the board adds ``(AD - AD_ref) * K`` counts to the target of a servo. AD is
the voltage of a sensor, converted with 10 bits (manual of the RCB-4HV). The only fitted constant is
``gain_unit``.
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, isfinite, radians, tau
from typing import Any, ClassVar, TypeVar

from khr_common import KhrError, fixed, parameter
from khr_common.block import Block, Numbers, Signals
from khr_common.interfaces import GYRO, STAGE, Topic
from khr_common.published import AD_STEP, GAIT_FREQUENCY, GYRO_SENSITIVITY, SERVO_STEP_DEG

SERVO_COUNT = radians(SERVO_STEP_DEG)  # rad
VOLTS_PER_RATE = GYRO_SENSITIVITY / radians(1.0)  # S_GY, V per rad/s, (5.2)
RADIANS_PER_VOLT = SERVO_COUNT / AD_STEP  # rad/V per unit of gain


def rate_gain(gain: float) -> float:
    """Return the correction in rad per rad/s of the gyro: 0.00463 s per unit of the board."""
    return gain * RADIANS_PER_VOLT * VOLTS_PER_RATE


def force_gain(gain: float, force_scale: float) -> float:
    """Return the correction in rad per N, for force sensors of ``force_scale`` V/N."""
    return gain * RADIANS_PER_VOLT * force_scale


@dataclass(frozen=True)
class FeedbackParameters:
    """Parameters of every feedback controller."""

    enabled: bool = parameter(
        False, 'Whether the controller is active; otherwise its correction is 0.'
    )
    gain: float = parameter(
        12.0,
        'Gain K; the correction is gain * gain_unit * 0.00463 deg per deg/s of the gyro.',
        '[0, 60]',
    )
    gain_unit: float = parameter(
        0.7786,
        'Ratio of the unit of the gain to the unit of the controller board; the gain of the '
        'amplifier between gyro and board is not published.',
        '[0.1, 10]',
    )
    limit_deg: float = parameter(30.0, 'Largest correction in both directions.', '[0, 60] deg')


def rate_delay(default: int) -> Any:
    """Return the parameter of the delay of the pitch rate; each controller has its own default."""
    return fixed(
        default,
        'Delay of the pitch rate before the comparator, in control periods, in addition to the '
        "board's own delay.",
        '[0, 10]',
    )


@dataclass(frozen=True)
class BalanceParameters(FeedbackParameters):
    """Parameters of the ankle and the hip controller."""

    staged: bool = fixed(
        False,
        'Whether to scale the correction by the share from the stage node; the mode of the stage '
        'node must then not be none.',
    )
    reference_amplitude: float = parameter(
        0.0,
        'Amplitude a of the reference rate a cos(2 pi f_0 t) of ideal walking.',
        '[0, 5] rad/s',
    )
    reference_offset: float = parameter(
        0.0,
        "Constant part of the reference rate: the offset of the comparator's reference from the "
        "gyro's voltage at rest; below 0 the robot leans back.",
        '[-1, 1] rad/s',
    )
    lean_deg: float = parameter(
        0.0,
        'Constant part of the correction by the gyro, independent of the gain, like an offset after '
        'the amplifier; above 0 the robot leans back.',
        '[-10, 10] deg',
    )
    rate_delay: int = rate_delay(0)
    start_ramp: float = parameter(
        1.0,
        'Time from the start of the run in which the correction rises linearly from 0 to its full '
        'value, like the mixing ratio on the board.',
        '[0, 10] s',
    )
    reference_frequency: float = parameter(
        GAIT_FREQUENCY,
        'Frequency f_0 of the reference rate: four peaks per gait cycle.',
        '[0, 20] Hz',
    )

    def constant(self, time: float) -> float:
        """Return the part of the correction that no sensor causes, rad, at a time in s."""
        if not self.enabled:
            return 0.0
        ramp = min(time / self.start_ramp, 1.0) if self.start_ramp else 1.0
        limit = radians(self.limit_deg)
        angle = radians(self.lean_deg) - rate_gain(self.gain * self.gain_unit) * (
            self.reference_offset
        )
        return ramp * max(-limit, min(limit, angle))


FeedbackTable = TypeVar('FeedbackTable', bound=FeedbackParameters)
BalanceTable = TypeVar('BalanceTable', bound=BalanceParameters)


class FeedbackController(Block[FeedbackTable]):
    """Publish one correction for a few joints: 0 if disabled, else :meth:`law` within the limit.

    A subclass declares its topics and implements the law. It publishes one topic of
    :func:`khr_common.interfaces.correction`.
    """

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the same angle for each joint, rad.

        Raises:
            KhrError: if the controller is enabled and a signal is not finite.
        """
        angle = self.correction(time, signals) if self.parameters.enabled else 0.0
        return ((angle,) * len(self.publishes[0].names),)

    def correction(self, time: float, signals: Signals) -> float:
        """Return the correction of an enabled controller, rad."""
        limit = radians(self.parameters.limit_deg)
        return max(-limit, min(limit, self.law(time, signals)))

    @property
    def rate_gain(self) -> float:
        """Return the correction in rad per rad/s of the gyro: ``gain`` times ``gain_unit``."""
        return rate_gain(self.parameters.gain * self.parameters.gain_unit)

    @abstractmethod
    def law(self, time: float, signals: Signals) -> float:
        """Return the correction before it is limited, rad."""


class BalanceController(FeedbackController[BalanceTable]):
    """Oppose a forward lean, scaled by the share of the stage if the controller is staged."""

    node: ClassVar[str]  # node name, also in the stage topic

    def __init__(self, parameters: BalanceTable) -> None:
        super().__init__(parameters)
        self._rates: deque[float] = deque(maxlen=parameters.rate_delay + 1)

    def configure(self, parameters: BalanceTable) -> None:
        """Use changed parameters; a law that pauses forgets its rates."""
        super().configure(parameters)
        if not (parameters.enabled and GYRO in self.senses()):
            self._rates.clear()

    def senses(self) -> tuple[Topic, ...]:
        """Return the sensor topics that the law uses with the present parameters."""
        return tuple(topic for topic in self.subscribes if topic is not STAGE)

    @property
    def needs(self) -> tuple[Topic, ...]:
        """Return the sensor topics, and the stage if the controller is staged."""
        return (*self.senses(), STAGE) if self.parameters.staged else self.senses()

    def correction(self, time: float, signals: Signals) -> float:
        """Return the ramped and staged correction, rad, positive against a forward lean."""
        angle = super().correction(time, signals)
        if time < self.parameters.start_ramp:
            angle *= time / self.parameters.start_ramp
        if not self.parameters.staged:
            return angle
        share = signals[STAGE][STAGE.names.index(self.node)]
        return finite('share', share, '[0, 1]') * angle

    def rate_law(self, time: float, pitch_rate: float) -> float:
        """Return K (w_meas - w_ref), which opposes the pitch rate, plus the constant lean, rad.

        Call it once for each sample: it stores the rate for the delay.

        (3.14) and (5.3) are printed with opposite signs; both describe negative feedback. On ankle
        and hip pitch (+y) a positive angle swings the body backward over a standing foot, so the
        correction has the sign of the forward pitch rate.

        The rate is delayed by ``rate_delay`` samples; the first sample replaces earlier ones.

        Args:
            time: s, for the reference (5.9).
            pitch_rate: w_meas, rad/s, forward positive.

        Raises:
            KhrError: if the rate is not finite.
        """
        own = self.parameters
        self._rates.append(finite('pitch_rate', pitch_rate, 'rad/s'))
        swing = own.reference_amplitude * cos(tau * own.reference_frequency * time)  # (5.9)
        reference = own.reference_offset + swing
        return self.rate_gain * (self._rates[0] - reference) + radians(own.lean_deg)


def finite(name: str, value: float, unit: str) -> float:
    """Check and return a measured value.

    Raises:
        KhrError: if it is not finite: a loop without a sensor must not look like a loop without
            an error.
    """
    if not isfinite(value):
        raise KhrError.refused(name, value, f'finite, in {unit}')
    return float(value)


def finite_forces(foot_forces: Sequence[float]) -> tuple[float, float, float, float]:
    """Return the normal forces on l_toe, l_heel, r_toe, r_heel, in N.

    Raises:
        KhrError: if they are not four finite numbers.
    """
    if len(foot_forces) != 4:
        raise KhrError.refused('foot_forces', foot_forces, 'l_toe, l_heel, r_toe, r_heel in N')
    l_toe, l_heel, r_toe, r_heel = (finite('foot_forces', force, 'N') for force in foot_forces)
    return l_toe, l_heel, r_toe, r_heel
