"""The gait: the joint angles that the robot's board plays back, without feedback.

A motion is planned in the stance plane (see :mod:`khr_balance.gaits.gait_plan`), converted to joint
angles and checked against the robot once; playback only evaluates a spline.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.gait_plan import plan_motion
from khr_balance.gaits.kinematics import ROBOT, GaitError, UnreachableError, forward, leg_angles
from khr_balance.gaits.plan import ClampedSpline, JointPlan, Plan
from khr_common.block import Block, NodeSpec, Numbers, Signals
from khr_common.interfaces import CLOCK, JOINT_INDEX, JOINT_REFERENCE, JOINTS, SIDES
from khr_common.published import NO_LOAD_SPEED
from khr_common.rotation import Array

__all__ = ['Gait', 'GaitParameters', 'gait_of']

_GRID = 0.005  # s; the splines through this grid stay within 1e-5 rad of the exact solution
_TOLERANCE = 1e-7  # m, of the centre of mass
_ITERATIONS = 500  # far more than any of our motions takes
_RELAXATION = 1.3  # over-relaxation: the feet do not move with the torso


class Gait:
    """A motion as a function of time.

    Attributes:
        duration: from time 0 to the end of the motion with its pauses, s.
        parameters: the table that it was built from.
    """

    def __init__(self, parameters: GaitParameters) -> None:
        """Plan and check the motion.

        Raises:
            GaitError: if a leg is too short, or a joint exceeds its range or the speed of its
                servo; the message names the joint (or leg) and the time. Also if the motion has
                no duration.
        """
        self.parameters = parameters
        plan = plan_motion(parameters)
        if not plan.duration:
            raise GaitError(
                'gait: start_delay and end_pause: 0 s of standing is not accepted; accepted: a sum '
                'above 0 s'
            )
        self.duration = plan.duration
        self._cycles = plan.cycles
        count = max(2, round(self.duration / _GRID) + 1)
        time = np.linspace(0.0, self.duration, count)
        angles = _angles(parameters, plan, time)
        spline = ClampedSpline(time, angles)
        self._starts, self._pieces = time[:-1], spline.pieces
        _check_ranges(plan, time, angles)
        _check_speeds(plan, time, spline.slopes)

    def reference(self, time: float) -> tuple[float, ...]:
        """Return the 17 joint angles (rad) at ``time`` (s), constant before 0 and after the end."""
        # Written out, because the spline's own evaluation is vectorised for many times.
        time = min(max(time, 0.0), self.duration)
        piece = min(int(time / self.duration * len(self._starts)), len(self._starts) - 1)
        t = time - float(self._starts[piece])
        t2, t3 = t * t, t * t * t
        return tuple(
            [
                d + c * t + b * t2 + a * t3
                for a, b, c, d in zip(*self._pieces[piece].tolist(), strict=True)
            ]
        )

    def cycle(self, number: int) -> tuple[float, float]:
        """Return the start and end (s) of a whole cycle of the walk, counted from 1.

        Raises:
            GaitError: if the motion does not have this cycle.
        """
        if not 1 <= number <= len(self._cycles):
            raise GaitError.refused('cycle', number, f'integer in [1, {len(self._cycles)}]')
        return self._cycles[number - 1]


@lru_cache(maxsize=8)
def gait_of(parameters: GaitParameters) -> Gait:
    """Return the motion of a parameter table, cached.

    Planning takes 0.1 s, and studies run one motion hundreds of times.

    Raises:
        GaitError: as ``Gait``.
    """
    return Gait(parameters)


class GaitBlock(Block[GaitParameters]):
    """Answer each clock message with the joint reference.

    The block subscribes to the clock instead of using a timer: a timer may skip a timestamp, but
    lockstep needs an answer to each.
    """

    subscribes = (CLOCK,)
    publishes = (JOINT_REFERENCE,)

    def __init__(self, parameters: GaitParameters) -> None:
        super().__init__(parameters)
        self.gait = gait_of(parameters)

    def check(self, parameters: GaitParameters) -> None:
        """Plan the motion before the parameters are accepted; raises GaitError."""
        gait_of(parameters)

    def configure(self, parameters: GaitParameters) -> None:
        """Plan the motion again with changed parameters."""
        super().configure(parameters)
        self.gait = gait_of(parameters)

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the 17 joint angles, rad."""
        return (self.gait.reference(time),)


GAIT = NodeSpec('gait', 'khr_balance', GaitParameters, GaitBlock)


def _angles(parameters: GaitParameters, plan: Plan | JointPlan, time: Array) -> Array:
    """Return the (N, 17) angles of a plan."""
    if isinstance(plan, Plan):
        return solve(_arms(parameters), plan, time, plan.torso_height(time))
    # with a pause of its own, because those of the motion may both be 0
    standing = replace(parameters, motion='stand', end_pause=1.0)
    angles = np.tile(gait_of(standing).reference(0.0), (len(time), 1))
    for joint, path in plan.angles.items():
        angles[:, JOINT_INDEX[joint]] = path(time)
    return angles


def solve(posture: Sequence[float] | Array, plan: Plan, time: Array, height: Array) -> Array:
    """Return the (N, 17) angles that move the centre of mass along its planned path.

    The position of the torso is found from the centre of mass by iteration.

    Args:
        posture: 17 angles, rad; those of head and arms are kept.
        plan: the paths.
        time: (N,), s.
        height: (N,) of the torso above the plane of the soles, m.

    Raises:
        GaitError: if a leg is too short, or the torso cannot reach its place.
    """
    centre, attitude = plan.centre_of_mass(time), plan.torso(time)
    torso = np.column_stack([centre, height])
    angles = np.tile(posture, (len(time), 1))
    for _ in range(_ITERATIONS):
        for side in SIDES:
            first = JOINT_INDEX[f'{side}_hip_roll']
            sole = plan.sole[side]
            try:
                angles[:, first : first + 5] = leg_angles(
                    side,
                    _to_torso(attitude, sole.centre(time) - torso),
                    _to_torso(attitude, sole.normal(time)),
                )
            except UnreachableError as error:
                raise GaitError(f'{error} ({_at(plan, time[error.index])})') from error
        found = torso + np.einsum('nij,nj->ni', attitude, forward(angles).centre_of_mass)
        miss = centre - found[:, :2]
        if np.max(np.abs(miss)) < _TOLERANCE:
            return angles
        torso[:, :2] += _RELAXATION * miss
    raise GaitError(
        f'centre of mass {_at(plan, time[int(np.argmax(np.abs(miss).max(axis=1)))])} is not '
        'accepted; accepted: a place that the torso can reach'
    )


def _to_torso(attitude: Array, vector: Array) -> Array:
    turned: Array = np.einsum('nji,nj->ni', attitude, vector)
    return turned


def _arms(parameters: GaitParameters) -> Array:
    angles = np.zeros(len(JOINTS))
    for side, outward in (('l', 1.0), ('r', -1.0)):
        angles[JOINT_INDEX[f'{side}_shoulder_pitch']] = parameters.shoulder_pitch
        angles[JOINT_INDEX[f'{side}_shoulder_roll']] = outward * parameters.shoulder_roll
        angles[JOINT_INDEX[f'{side}_elbow_pitch']] = parameters.elbow_pitch
    return angles


def _at(plan: Plan | JointPlan, time: float) -> str:
    """Return a time as text, with the key frames of a file around it."""
    text = f'at {time:.2f} s'
    if not plan.frames:
        return text
    place = bisect_right(plan.frames, time, key=lambda frame: frame[0])
    around = plan.frames[max(0, min(place, len(plan.frames) - 1) - 1) :][:2]
    return f'{text} of the run, frames {around[0][1]} to {around[-1][1]}'


def _check_ranges(plan: Plan | JointPlan, time: Array, angles: Array) -> None:
    low, high = ROBOT.limits().T
    excess = np.maximum(low - angles, angles - high)
    step, joint = np.unravel_index(int(np.argmax(excess)), excess.shape)
    if excess[step, joint] > 0.0:
        raise GaitError(
            f'{JOINTS[joint]}: {angles[step, joint]:.3f} rad {_at(plan, time[step])} is not '
            f'accepted; accepted: [{low[joint]:.3f}, {high[joint]:.3f}] rad'
        )


def _check_speeds(plan: Plan | JointPlan, time: Array, speeds: Array) -> None:
    step, joint = np.unravel_index(int(np.argmax(np.abs(speeds))), speeds.shape)
    if abs(speeds[step, joint]) > NO_LOAD_SPEED:
        raise GaitError(
            f'{JOINTS[joint]}: {speeds[step, joint]:.2f} rad/s {_at(plan, time[step])} is '
            f'not accepted; accepted: up to {NO_LOAD_SPEED} rad/s, the speed of its servo'
        )
