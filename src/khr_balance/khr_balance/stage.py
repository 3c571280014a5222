"""Staged control: select the controllers by the inclination estimated at the feet and joints.

In Dutta (2021), chapter 3, the robot stands in three stages: without control up to the first
critical inclination, with the ankle up to the second, with ankle and hip beyond it. The
inclination is estimated from Delta (3.7).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, inf, radians
from typing import NamedTuple

import numpy as np

from khr_balance.feedback import finite_forces
from khr_balance.gaits.kinematics import forward
from khr_common import KhrError, ParameterError, parameter, sample_period
from khr_common.block import CoreBlock, NodeSpec, Numbers, Signals
from khr_common.interfaces import FOOT_FORCES, JOINT_STATES, JOINTS, SIDES, STAGE, STAGE_CHANGES
from khr_common.rotation import applied
from khr_common.signals import LowPass

STAGES = (1, 2, 3)  # no control; ankle; ankle and hip


@dataclass(frozen=True)
class StageParameters:
    """The parameter table of the stage node.

    The two inclinations are 1 deg below the limits measured in the thesis, 6.4 and 7.6 deg,
    because at the limit control would start too late. On ground that tilts at 0.5 deg/s, the
    sensors (0.5 s) delay the estimate by 0.25 deg, and the ramp of a controller takes 0.5 deg;
    0.25 deg remain for the error of the estimate.

    Raises:
        ParameterError: if the hip would start below the ankle.
    """

    mode: str = parameter(
        'none',
        'Source of the stage: none (all enabled controllers act, as in stage 3; khr starts no '
        'stage node), fixed (the parameter fixed_stage), or auto (the estimated inclination).',
        choices=('none', 'fixed', 'auto'),
    )
    fixed_stage: int = parameter(
        1,
        'Stage in the mode fixed: 1 no control, 2 ankle, 3 ankle and hip.',
        f'[{STAGES[0]}, {STAGES[-1]}]',
    )
    ankle_above_deg: float = parameter(
        5.4, 'Inclination above which the ankle controller starts.', '[0, 30] deg'
    )
    hip_above_deg: float = parameter(
        6.6, 'Inclination above which the hip controller starts.', '[0, 30] deg'
    )
    hysteresis_deg: float = parameter(
        0.5,
        'Hysteresis: a controller stops when the inclination is below its threshold by this '
        'angle; the noise of the estimate is a tenth of the default.',
        '[0, 10] deg',
    )
    ramp_time: float = parameter(
        1.0,
        'Duration of the linear ramp of a controller that starts or stops; the stage does not '
        'change meanwhile.',
        '[0, 60] s',
    )
    sensor_distance: float = parameter(
        0.02669, 'Distance b of the toe and heel sensors from the ankle axis.', '[0.005, 0.06] m'
    )
    load_threshold: float = parameter(
        5.0,
        'Force on both feet together below which the last estimate is kept; the robot weighs '
        '14.7 N.',
        '[0.1, 50] N',
    )
    time_constant: float = parameter(
        0.5,
        'Time constant of the low-pass for the joint angles; equal to that of the force sensors, '
        'so that both have the same delay.',
        '[0, 1] s',
    )
    control_period: float = sample_period()

    def __post_init__(self) -> None:
        if self.hip_above_deg < self.ankle_above_deg:
            raise ParameterError.refused(
                'hip_above_deg',
                self.hip_above_deg,
                f'at least ankle_above_deg, {self.ankle_above_deg!r}',
            )


class Stage(NamedTuple):
    """The stage and the active shares of the corrections."""

    number: int  # 1, 2 or 3
    # estimate for the ground, rad, downhill positive; 0 before the first estimate
    inclination: float
    # ankle, hip: active shares of the two corrections, 0 to 1
    ankle: float
    hip: float


class StagePolicy:
    """Select the stage at each sample, and ramp the controllers up and down."""

    def __init__(self, parameters: StageParameters) -> None:
        self.parameters = parameters
        self._posture = LowPass(
            len(JOINTS) + 1, parameters.control_period, parameters.time_constant
        )
        number = 1 if self.parameters.mode == 'auto' else self._commanded()
        self._now = Stage(number, 0.0, *_wanted(number))

    def configure(self, parameters: StageParameters) -> None:
        """Use changed parameters from the next sample on; the state is kept."""
        self.parameters = parameters
        self._posture.configure(parameters.time_constant)

    def update(self, foot_forces: Sequence[float], joint_angles: Sequence[float]) -> Stage:
        """Return the stage for a sample.

        Args:
            foot_forces: normal forces on l_toe, l_heel, r_toe, r_heel, N.
            joint_angles: 17 measured angles, rad, in the order of the joints.

        Raises:
            KhrError: if a value is missing or not finite.
        """
        own, before = self.parameters, self._now
        forces = finite_forces(foot_forces)
        inclination = before.inclination
        posture = self._late(joint_angles)
        if sum(forces) >= own.load_threshold:
            inclination = read_inclination(forces, posture, own.sensor_distance)
        number = before.number
        if own.mode != 'auto':
            number = self._commanded()
        elif (before.ankle, before.hip) == _wanted(number):
            number = self._chosen(inclination)
        most = own.control_period / own.ramp_time if own.ramp_time > 0.0 else inf
        shares = (
            share + min(max(wanted - share, -most), most)
            for share, wanted in zip((before.ankle, before.hip), _wanted(number), strict=True)
        )
        self._now = Stage(number, inclination, *shares)
        return self._now

    def _late(self, joint_angles: Sequence[float]) -> list[float]:
        """Return the joint angles, delayed like the force sensors, which also start from 0."""
        if len(joint_angles) != len(JOINTS) or not np.isfinite(joint_angles).all():
            raise KhrError.refused(
                'joint_angles', joint_angles, f'{len(JOINTS)} finite angles in rad'
            )
        *angles, weight = self._posture.update([*joint_angles, 1.0])
        return [angle / weight for angle in angles]

    def _commanded(self) -> int:
        return self.parameters.fixed_stage if self.parameters.mode == 'fixed' else STAGES[-1]

    def _chosen(self, inclination: float) -> int:
        """Return the stage for an inclination in rad, at most one from the present stage."""
        own, number = self.parameters, self._now.number
        above = (radians(own.ankle_above_deg), radians(own.hip_above_deg))
        if number < STAGES[-1] and inclination > above[number - 1]:
            return number + 1
        if number > STAGES[0] and inclination < above[number - 2] - radians(own.hysteresis_deg):
            return number - 1
        return number


def read_inclination(
    foot_forces: Sequence[float], joint_angles: Sequence[float], sensor_distance: float
) -> float:
    """Estimate the ground's inclination from the forces, in rad, downhill positive.

    At rest the ground's force acts vertically below the centre of mass. The sensors give its
    point of action: b (F_T - F_H)/(F_T + F_H) ahead of the ankle of one foot. The joint angles
    give the centre of mass, including the lean theta_A0 of (3.10), the lean theta_A of (3.7) by a
    controller, the sag of the servos and a lifted leg. With Delta = F_T - F_H, one foot or two
    side by side, and small angles, the estimate is (3.7) solved for phi.

    The estimate is exact at rest on flat feet. After the toes or heels have taken the whole load,
    it saturates at the inclination of that moment.

    Args:
        foot_forces: normal forces on l_toe, l_heel, r_toe, r_heel, N, not all zero.
        joint_angles: 17 angles, rad.
        sensor_distance: b, m.
    """
    body = forward(joint_angles)
    point, axes = np.zeros(3), np.zeros((3, 3))
    for side, toe, heel in zip(SIDES, foot_forces[::2], foot_forces[1::2], strict=True):
        sole = body.sole_rotation[side]
        point += (toe + heel) * body.sole_position[side] + (toe - heel) * sensor_distance * sole[
            :, 0
        ]
        axes += (toe + heel) * sole
    ahead, _, up = applied(axes.T, point / sum(foot_forces) - body.centre_of_mass)
    return atan2(ahead, -up)


def _wanted(number: int) -> tuple[float, float]:
    return float(number >= 2), float(number >= 3)


class StageBlock(CoreBlock[StageParameters, StagePolicy]):
    """Answer each sample of foot forces and joint angles with the stage."""

    subscribes = (*FOOT_FORCES, JOINT_STATES)
    publishes = (STAGE,)

    def __init__(self, parameters: StageParameters) -> None:
        super().__init__(parameters, StagePolicy(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the stage, the inclination in rad, and the active shares of ankle and hip."""
        forces = [signals[topic][2] for topic in FOOT_FORCES]
        return (tuple(map(float, self.core.update(forces, signals[JOINT_STATES]))),)


STAGE_NODE = NodeSpec(
    'stage',
    'khr_balance',
    StageParameters,
    StageBlock,
    publishes=(STAGE, STAGE_CHANGES),
    node='khr_balance.nodes.stage:StageNode',
    joins=lambda parameters: parameters.mode != 'none',
)
