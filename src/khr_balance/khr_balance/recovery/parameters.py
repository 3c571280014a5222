"""The parameters of the recovery node."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from khr_common import parameter, sample_period

FORWARD, BACKWARD = 0, 1  # indices of the pairs below
SIGNS = (1.0, -1.0)  # of both directions


def _pair(description: str, forward: float, backward: float, accepted: str) -> Any:
    """Declare a parameter with a value for a fall forward and one for a fall backward."""
    return parameter((forward, backward), f'Forward, backward: {description}', accepted, length=2)


@dataclass(frozen=True)
class RecoveryParameters:
    """The parameter table of the recovery node.

    The values of the step are found by search on the simulated robot (docs/recovery.md).
    """

    enabled: bool = parameter(
        False, 'Whether the robot steps when it falls; khr starts the node only if it is true.'
    )
    threshold: tuple[float, ...] = _pair(
        'distance of the capture point from the middle of the soles above which the robot steps.',
        0.042,
        0.041,
        '[0, 0.2] m',
    )
    rate_threshold_deg: tuple[float, ...] = _pair(
        'pitch rate above which the robot steps, if the capture point is beyond its threshold as '
        'well.',
        35.0,
        50.0,
        '[0, 500] deg/s',
    )
    tipping_threshold: tuple[float, ...] = _pair(
        'distance of the capture point from the middle of the soles above which the robot steps '
        'at a lower rate: a force goes on, or the fall is slow.',
        0.065,
        0.04,
        '[0, 0.3] m',
    )
    tipping_rate_deg: tuple[float, ...] = _pair(
        'pitch rate above which the robot steps by ``tipping_threshold``.',
        10.0,
        12.0,
        '[0, 500] deg/s',
    )
    slow_rate_deg: tuple[float, ...] = _pair(
        'pitch rate from which on a fall is fast, and ``tipping_threshold`` does not apply.',
        500.0,
        45.0,
        '[0, 500] deg/s',
    )
    moving_threshold: tuple[float, ...] = _pair(
        'distance of the capture point beyond the support of a moving reference above which the '
        'robot stops it and steps; 0.3 leaves it alone.',
        0.0,
        -0.02,
        '[-0.1, 0.3] m',
    )
    moving_rate_deg: tuple[float, ...] = _pair(
        'pitch rate above which the robot steps by ``moving_threshold``.',
        60.0,
        50.0,
        '[0, 500] deg/s',
    )
    undamped_rate_deg: tuple[float, ...] = _pair(
        '``moving_rate_deg`` of a walk without ankle control, which pitches faster.',
        105.0,
        105.0,
        '[0, 500] deg/s',
    )
    step_length: tuple[float, ...] = _pair('length of the step.', 0.0992, 0.0672, '[0, 0.16] m')
    swing_time: tuple[float, ...] = _pair(
        'time from the decision to the end of the swing.', 0.1032, 0.2209, '[0.06, 1] s'
    )
    clearance: tuple[float, ...] = _pair(
        'height of the swinging foot over the ground.', 0.008, 0.026, '[0, 0.05] m'
    )
    landing_height: tuple[float, ...] = _pair(
        'height of the sole over the ground at the end of the swing; below 0 it presses.',
        -0.009,
        0.0002,
        '[-0.03, 0.03] m',
    )
    bow: tuple[float, ...] = _pair(
        'bow of the torso in the hip of the standing leg during the swing, forward positive.',
        -0.14,
        0.44,
        '[-0.8, 0.8] rad',
    )
    ankle_push: tuple[float, ...] = _pair(
        'turn of the standing ankle during the swing, against a forward lean positive.',
        0.074,
        0.26,
        '[-0.5, 0.5] rad',
    )
    tipping_ankle_push: tuple[float, ...] = _pair(
        '``ankle_push`` of a step by ``tipping_threshold``.', 0.074, 0.09, '[-0.5, 0.5] rad'
    )
    ankle_roll: tuple[float, ...] = _pair(
        'roll of the standing ankle during the swing, outward positive.',
        0.1034,
        0.0,
        '[-0.3, 0.3] rad',
    )
    settle_time: tuple[float, ...] = _pair(
        'time from the end of the swing to the split stance.', 0.05, 0.14, '[0.05, 3] s'
    )
    split_shift: tuple[float, ...] = _pair(
        'centre of mass ahead of the middle of the split stance.',
        -0.0052,
        -0.0045,
        '[-0.08, 0.08] m',
    )
    split_drop: tuple[float, ...] = _pair(
        'height by which the split stance is lower than the stance.', 0.0283, 0.017, '[0, 0.05] m'
    )
    foot: str = parameter('right', 'Foot that steps.', choices=('left', 'right'))
    rest_time: float = parameter(1.0, 'Time in the split stance.', '[0, 60] s')
    close_time: float = parameter(
        3.0, 'Time in which the other foot follows to a place beside the first.', '[0.5, 30] s'
    )
    return_time: float = parameter(
        0.5, 'Time in which the joints return to the reference.', '[0.05, 10] s'
    )
    height: float = parameter(
        0.18,
        'Ratio of the motion of the centre of mass to the rotation of the torso on flat soles; '
        'fitted to the simulated robot: its torso sways more than its body.',
        '[0.05, 0.5] m',
    )
    tipping_height: float = parameter(
        0.25, 'The same ratio on the edge of the soles; fitted.', '[0.05, 0.5] m'
    )
    tipping_distance: float = parameter(
        0.045,
        'Distance of the capture point from the middle of the soles above which the robot tips '
        'on their edge.',
        '[0, 0.2] m',
    )
    gyro_lag: float = parameter(
        0.02, 'Lag of the gyro, by which the estimate is advanced.', '[0, 0.2] s'
    )
    growth_rate: float = parameter(
        6.0, 'Growth rate omega of a fall about the edge of the soles.', '[1, 20] 1/s'
    )
    sole_distance: float = parameter(
        0.055,
        'Distance of the contacts of toe and heel from the middle of the sole.',
        '[0.005, 0.1] m',
    )
    quiet_rate_deg: float = parameter(
        10.0, 'Pitch rate below which the robot counts as quiet.', '[0, 100] deg/s'
    )
    quiet_time: float = parameter(
        0.3, 'Time below this rate after which the estimate follows the foot forces.', '[0, 10] s'
    )
    quiet_time_constant: float = parameter(
        0.5, 'Time constant with which it follows them.', '[0.02, 60] s'
    )
    moving_time_constant: float = parameter(
        0.5,
        'Time constant with which the estimate decays while the reference moves.',
        '[0.02, 60] s',
    )
    control_period: float = sample_period()
