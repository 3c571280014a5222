"""The way from the split stance after a step back to the stance."""

from __future__ import annotations

from itertools import accumulate

import numpy as np

from khr_balance.gaits.body import Array
from khr_balance.gaits.gait import solve
from khr_balance.gaits.plan import Plan, Sole
from khr_balance.gaits.splines import ConstantPath, RestingPath
from khr_balance.joints import other_side
from khr_balance.recovery.parameters import RecoveryParameters, StepShape
from khr_balance.recovery.stance import Stance

PARTS = (0.35, 0.1, 0.15, 0.4)  # of close_time: weight shift, lift, lowering, shift back
# m, of the centre of mass from the middle of the standing sole: a robot with soft gears sags
# outward, and with 3 mm it tips over the outer edge
INBOARD = 0.012
HEEL_OFF = 0.3  # rad, of a rear foot on its toe; flat, its leg would be too short
CROUCH = 0.03  # m, of the hips, for the same reason
LIFT = 0.02  # m
ROLL = 0.1  # rad, of the torso towards the standing leg


def closing_angles(
    stance: Stance, foot: str, shape: StepShape, parameters: RecoveryParameters
) -> Array:
    """Return the joint angles from the split stance to the stance, (N, 17), rad.

    They hold the split stance for ``rest_time``, shift the weight over the foot that stepped, place
    the other foot beside it, and rise.

    Args:
        stance: before the step.
        foot: side of the foot that stepped.
        shape: of the step.
        parameters: times.

    Raises:
        GaitError: if a leg is too short for the step.
    """
    other = other_side(foot)
    begin, shifted, high, down, end = accumulate(
        (parameters.rest_time, *(part * parameters.close_time for part in PARTS))
    )
    ahead = float(stance.soles[foot][0]) + shape.sign * shape.step_length
    behind = float(stance.soles[other][0])
    beside = ahead + behind - float(stance.soles[foot][0])
    left = 1.0 if foot == 'l' else -1.0
    inboard = abs(float(stance.soles[foot][1])) - INBOARD

    def shift(place: float) -> RestingPath:
        return RestingPath((begin, shifted, down, end), (0.0, place, place, 0.0))

    flat = ConstantPath(0.0)
    tip = RestingPath((begin, shifted, (high + down) / 2.0), (0.0, HEEL_OFF, 0.0))
    plan = Plan(
        duration=end,
        sole={
            foot: Sole(float(stance.soles[foot][1]), ConstantPath(ahead), flat, flat),
            other: Sole(
                float(stance.soles[other][1]),
                RestingPath((shifted, down), (behind, beside)),
                RestingPath((shifted, high, down), (0.0, LIFT, 0.0)),
                tip if shape.sign > 0.0 else flat,
            ),
        },
        com=(
            RestingPath(
                (begin, shifted, down),
                (
                    (ahead + behind) / 2.0 + shape.split_shift,
                    ahead,
                    (ahead + beside) / 2.0 + float(stance.com[0]),
                ),
            ),
            shift(left * inboard),
        ),
        torso_roll=shift(-left * ROLL),
        torso_pitch=stance.torso_pitch,
        hip_height=0.0,  # not used: the height of the torso is given
    )
    drop = RestingPath((begin, shifted, down, end), (shape.split_drop, CROUCH, CROUCH, 0.0))
    time = np.arange(0.0, end + parameters.control_period, parameters.control_period)
    return solve(stance.posture, plan, time, stance.torso_height - drop(time))
