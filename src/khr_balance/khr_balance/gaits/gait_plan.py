"""Plan standing, the leg lift and the walk in the stance plane."""

from __future__ import annotations

import numpy as np

from khr_balance.gaits.file_plan import plan_from_file
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.plan import (
    ClampedSpline,
    JointPlan,
    Keys,
    Path,
    Plan,
    RestingPath,
    Sole,
    constant_path,
)
from khr_common.interfaces import other_side


def plan_motion(parameters: GaitParameters) -> Plan | JointPlan:
    """Return the plan of the motion in the parameters.

    Raises:
        GaitError: if key frames are not accepted.
    """
    p = parameters
    if p.motion == 'file':
        return plan_from_file(p)
    if p.motion == 'walk':
        return _Walk(p).plan()
    if p.motion == 'leg_lift':
        return _leg_lift(p)
    if p.motion == 'stand':
        return _stance(p, p.com_stance, 0.0, p.hip_height)
    left_ahead = p.guard_split if p.first_foot == 'left' else -p.guard_split
    return _stance(p, p.guard_com, left_ahead, p.guard_height)


def _rests(keys: Keys) -> Path:
    """Return a path that rests at every key: minimum-jerk quintics, C2."""
    return RestingPath(*zip(*keys, strict=True))


def _flows(keys: Keys) -> Path:
    """Return a path through the keys that rests at both ends only: a cubic spline, C2."""
    return ClampedSpline(*zip(*keys, strict=True))


def _stance(p: GaitParameters, com: float, left_ahead: float, hip_height: float) -> Plan:
    """Stand upright, or crouched with one foot ahead, the guard."""
    half, flat = p.foot_spread / 2.0, constant_path(0.0)
    return Plan(
        duration=p.start_delay + p.end_pause,
        sole={
            'l': Sole(half, constant_path(left_ahead / 2.0), flat, flat),
            'r': Sole(-half, constant_path(-left_ahead / 2.0), flat, flat),
        },
        com=(constant_path(com), flat),
        torso_roll=flat,
        torso_pitch=p.torso_pitch,
        hip_height=hip_height,
    )


def _leg_lift(p: GaitParameters) -> Plan:
    """Shift the weight over one leg, lift the other, hold, set down, shift back (chapter 3)."""
    durations = (p.shift_time, p.lift_time, p.hold_time, p.lower_time, p.shift_time)
    shifted, up, down, back, end = (p.start_delay + np.cumsum(durations)).tolist()
    stance_side = 1.0 if p.first_foot == 'right' else -1.0
    half = p.foot_spread / 2.0

    def shift(place: float) -> Path:
        return _rests([(p.start_delay, 0.0), (shifted, place), (back, place), (end, 0.0)])

    def lift(low: float, high: float) -> Path:
        held = [(down, high)] if down > up else []
        return _rests([(shifted, low), (up, high), *held, (back, low)])

    def raised(side: str) -> Path:
        return lift(0.0, p.lift) if side == p.first_foot[0] else constant_path(0.0)

    return Plan(
        duration=end + p.end_pause,
        sole={
            'l': Sole(half, constant_path(0.0), raised('l'), constant_path(0.0)),
            'r': Sole(-half, constant_path(0.0), raised('r'), constant_path(0.0)),
        },
        com=(
            lift(p.com_stance, p.lift_com_ahead),
            shift(stance_side * (half - p.lift_com_inboard)),
        ),
        torso_roll=shift(-stance_side * p.lift_torso_roll),
        torso_pitch=p.torso_pitch,
        hip_height=p.hip_height,
    )


class _Walk:
    """Collect the keys of a straight walk step by step; a step is half a cycle.

    From stance to stance it is half a cycle, the whole cycles, and half a cycle. The first step
    moves one foot a stride ahead, each further step moves the rear foot past the front foot, and
    the last step moves it beside the front foot.
    """

    def __init__(self, p: GaitParameters) -> None:
        self._p = p
        self.steps = 2 * p.cycles + 2
        self._step_time = p.cycle_period / 2.0
        ends = self._step_time * np.cumsum(p.phases) / sum(p.phases)
        self._lift_off, self._high, self._over, self._down = ends[:4].tolist()
        self._place = {'l': 0.0, 'r': 0.0}
        self._forward, self._upward, self._tipping = (
            {side: [(0.0, 0.0)] for side in self._place} for _ in range(3)
        )
        self._com_x = [(p.start_delay, p.com_stance + p.walk_start_shift)]
        self._com_y = [(p.start_delay, 0.0)]
        for number in range(self.steps):
            self._take_step(number)

    def _take_step(self, number: int) -> None:
        """Add the keys of one step, counted from 0."""
        p, start = self._p, self._start(number)
        last = number == self.steps - 1
        swing, stance = (p.first_foot[0], other_side(p.first_foot[0]))[:: 1 - 2 * (number % 2)]
        here, before = self._place[stance], self._place[swing]
        self._place[swing] = here if last else here + p.stride
        self._forward[swing] += [
            (start + self._lift_off, before),
            (start + self._down, self._place[swing]),
        ]
        self._upward[swing] += [
            (start + self._lift_off, 0.0),
            (start + self._high, p.lift),
            (start + self._over, p.lift),
            (start + self._down, 0.0),
        ]
        if number > 0:
            self._tipping[swing] += [
                (start, 0.0),
                (start + self._lift_off, p.heel_off),
                (start + self._over, 0.0),
            ]
        if not last:
            shift = 0.0 if number else p.first_step_shift
            self._com_x += [
                (start + self._high, here + p.com_lifted + shift),
                (start + self._down, here + p.com_touchdown),
            ]
        self._sway(start, p.sway if stance == 'l' else -p.sway)

    def plan(self) -> Plan:
        """Return the plan of all steps."""
        p, finish = self._p, self._start(self.steps)
        com_x = [*self._com_x, (finish, self._place['l'] + p.com_stance + p.walk_start_shift)]
        sole = {
            side: Sole(
                y, *(_rests(keys[side]) for keys in (self._forward, self._upward, self._tipping))
            )
            for side, y in (('l', p.foot_spread / 2.0), ('r', -p.foot_spread / 2.0))
        }
        return Plan(
            duration=finish + p.end_pause,
            sole=sole,
            com=(_flows(com_x), _flows(self._com_y)),
            torso_roll=constant_path(0.0),
            torso_pitch=p.torso_pitch,
            hip_height=p.hip_height,
            cycles=tuple(
                (self._start(2 * cycle + 1), self._start(2 * cycle + 3))
                for cycle in range(p.cycles)
            ),
        )

    def _start(self, number: int) -> float:
        return self._p.start_delay + number * self._step_time

    def _sway(self, start: float, sway: float) -> None:
        """Follow half a sine towards the stance foot, through the ends of single support."""
        for time in (self._lift_off, (self._lift_off + self._down) / 2.0, self._down):
            self._com_y.append((start + time, sway * np.sin(np.pi * time / self._step_time)))
        self._com_y.append((start + self._step_time, 0.0))
