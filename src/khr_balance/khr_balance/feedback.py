"""The proportional law that ankle and hip controller share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, isfinite, radians, tau

from khr_balance.board_units import rate_gain
from khr_balance.errors import BalanceError
from khr_common import parameter


@dataclass(frozen=True)
class FeedbackParameters:
    """What both controllers' tables hold."""

    enabled: bool = parameter(True, 'Whether to correct; if not, the correction is 0.')
    staged: bool = parameter(
        False,
        'Whether to correct only by the share that the stage node gives; its mode must not '
        'be none then.',
        read_only=True,
    )
    gain: float = parameter(
        12.0,
        'Gain K in units of the controller board: 0.00463 deg per deg/s of the gyro.',
        minimum=0.0,
        maximum=60.0,
    )
    reference_amplitude: float = parameter(
        0.0,
        'Amplitude a of the reference rate a cos(2 pi f_0 t) of ideal walking.',
        unit='rad/s',
        minimum=0.0,
        maximum=5.0,
    )
    reference_frequency: float = parameter(
        4.0 / 2.31,
        'Frequency f_0 of the reference rate: four peaks per gait cycle.',
        unit='Hz',
        minimum=0.0,
        maximum=20.0,
    )
    limit_deg: float = parameter(
        30.0, 'Largest correction, either way.', unit='deg', minimum=0.0, maximum=60.0
    )


def rate_correction(own: FeedbackParameters, time: float, pitch_rate: float | None) -> float:
    """Return K (w_meas - w_ref), the correction in rad against a forward pitch rate.

    (3.14) and (5.3) print opposite signs; both mean negative feedback. On ankle and hip pitch
    (+y) a positive angle swings the body backward over a standing foot, so the correction has the
    sign of the forward pitch rate.

    Args:
        own: parameters.
        time: s, for the reference (5.9).
        pitch_rate: w_meas, rad/s, forward positive.

    Raises:
        BalanceError: if the rate is missing or not finite.
    """
    measured = checked('pitch_rate', pitch_rate, 'rad/s')
    reference = own.reference_amplitude * cos(tau * own.reference_frequency * time)  # (5.9)
    return limited(own, rate_gain(own.gain) * (measured - reference))


def limited(own: FeedbackParameters, correction: float) -> float:
    """Return the correction within the limit, in rad."""
    limit = radians(own.limit_deg)
    return max(-limit, min(limit, correction))


def shared(own: FeedbackParameters, share: float | None, correction: float) -> float:
    """Return the share of a correction, in rad, that the stage gives, or all if unstaged.

    Raises:
        BalanceError: if it is staged, and the share is missing or not finite.
    """
    return checked('share', share, '[0, 1]') * correction if own.staged else correction


def checked(name: str, value: float | None, unit: str) -> float:
    """Return a measured value.

    Raises:
        BalanceError: if it is missing or not finite: a loop without its sensor must not pass for
            one that has nothing to correct.
    """
    if value is None or not isfinite(value):
        raise BalanceError(f'{name}: {value!r} is not accepted; accepted: finite, in {unit}')
    return float(value)


def checked_forces(foot_forces: Sequence[float] | None) -> tuple[float, float, float, float]:
    """Return the normal forces on l_toe, l_heel, r_toe, r_heel, in N.

    Raises:
        BalanceError: if they are not four finite numbers.
    """
    if foot_forces is None or len(foot_forces) != 4:
        raise BalanceError(
            f'foot_forces: {foot_forces!r} is not accepted; '
            f'accepted: l_toe, l_heel, r_toe, r_heel in N'
        )
    l_toe, l_heel, r_toe, r_heel = (checked('foot_forces', force, 'N') for force in foot_forces)
    return l_toe, l_heel, r_toe, r_heel
