"""Plan a motion from key frames, and return the key frames of a planned motion."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, isclose, nextafter

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.key_frames import FEET, KeyFrames, merged, read_key_frames
from khr_balance.gaits.kinematics import GaitError
from khr_balance.gaits.plan import (
    ClampedSpline,
    JointPlan,
    Path,
    Plan,
    RestingPath,
    Sole,
    constant_path,
)
from khr_common.interfaces import SIDES

ADVANCING = ('com_x', 'l_sole_x', 'r_sole_x')  # a repeated part may move these on
LONGEST = 3600.0  # s
Keys = Sequence[tuple[float, float]]


def plan_from_file(parameters: GaitParameters) -> Plan | JointPlan:
    """Return the plan of a motion from key frames.

    Raises:
        GaitError: if there are no frames, or the part to repeat does not join its own start.
    """
    p = parameters
    if not p.frames:
        raise GaitError(
            "gait: motion: 'file' is not accepted without frames; accepted: a motion_file in a "
            'scenario that khr reads'
        )
    part = _Repetition(p, read_key_frames(p.frames, p.motion_file))
    duration = p.start_delay + part.end + p.end_pause
    if duration > LONGEST:
        raise GaitError(
            f'{p.motion_file}: {duration:g} s with all repetitions is not accepted; accepted: up '
            f'to {LONGEST:g} s'
        )
    if part.frames.of_joints:
        angles = {name: part.path(name, p.between) for name in part.frames.columns}
        return JointPlan(duration, angles, part.cycles, part.numbers)
    half = p.foot_spread / 2.0
    return Plan(
        duration=duration,
        sole={
            side: Sole(
                y,
                part.path(f'{side}_sole_x'),
                part.path(f'{side}_sole_z'),
                part.path(f'{side}_sole_pitch'),
            )
            for side, y in zip(SIDES, (half, -half), strict=True)
        },
        com=(part.path('com_x', p.between, p.com_stance), part.path('com_y', p.between)),
        torso_roll=part.path('torso_roll'),
        torso_pitch=p.torso_pitch,
        hip_height=p.hip_height,
        cycles=part.cycles,
        frames=part.numbers,
    )


class _Repetition:
    """The keys of all columns, with a part of them repeated.

    Attributes:
        frames: as in the file.
        end: time of the last frame from the start of the motion, s.
        cycles: start and end of each repetition, s.
        numbers: time in the run (s) and number of each frame as played.
    """

    def __init__(self, parameters: GaitParameters, frames: KeyFrames) -> None:
        self.frames, self._parameters = frames, parameters
        self._from, self._to = parameters.repeat
        self._span = self._to - self._from
        self._count = parameters.cycles if self._span else 1
        self._check_ends()
        self.end = frames.times[-1] + (self._count - 1) * self._span
        start = parameters.start_delay
        self.cycles = tuple(
            (start + self._from + n * self._span, start + self._to + n * self._span)
            for n in range(self._count if self._span else 0)
        )
        numbered = enumerate(frames.times, 1)
        self.numbers = tuple((t, round(n)) for t, n in self._played([(t, n) for n, t in numbered]))

    def path(self, column: str, between: str = 'rest', otherwise: float = 0.0) -> Path:
        """Return the path of a column in the time of the run."""
        keys = self.frames.keys(column)
        advance = self._advance(column) if self._span and column in ADVANCING else 0.0
        played = self._played(keys, advance)
        if len(played) < 2:
            return constant_path(played[0][1] if played else otherwise)
        return (RestingPath if between == 'rest' else ClampedSpline)(*zip(*played, strict=True))

    def _played(self, keys: Keys, advance: float = 0.0) -> list[tuple[float, float]]:
        """Return keys in the time of the run, with the repeated part as often as it is played."""
        played = []
        for time, value in keys:
            if not self._span or time <= self._from:
                copies: Sequence[int] = (0,)
            elif time <= self._to:
                copies = range(self._count)
            else:
                copies = (self._count - 1,)
            played += [(time + n * self._span, value + n * advance) for n in copies]
        return [(self._parameters.start_delay + time, value) for time, value in sorted(played)]

    def _check_ends(self) -> None:
        if not self._span and not self._from:
            return
        ends, times = self._parameters.repeat, self.frames.times
        if self._span <= 0.0 or not set(ends) <= set(times):
            raise GaitError.refused(
                'gait: repeat',
                list(ends),
                f'the times of two frames of {self._parameters.motion_file}, the earlier first, '
                'or [0.0, 0.0]',
            )
        first, last = (times.index(end) for end in ends)
        for column, values in self.frames.columns.items():
            if len(self.frames.keys(column)) > 1:
                self._check_column(column, first, values[first], last, values[last])
        if len({round(self._advance(column), 9) for column in ADVANCING}) > 1 and not (
            self.frames.of_joints
        ):
            raise GaitError(
                f'{self._parameters.motion_file}: frames {first + 1} and {last + 1}: feet and '
                'centre of mass move on by different lengths; accepted: one length for '
                + ', '.join(ADVANCING)
            )

    def _advance(self, column: str) -> float:
        keys = dict(self.frames.keys(column))
        return keys[self._to] - keys[self._from] if len(keys) > 1 else 0.0

    def _check_column(
        self, column: str, first: int, start: float | None, last: int, end: float | None
    ) -> None:
        if start is None or end is None:
            number = (first if start is None else last) + 1
            wanted = 'a value at the start and end of the repeated part'
        elif column not in ADVANCING and not isclose(start, end, abs_tol=1e-9):
            number, wanted = last + 1, f'{start:g}, as in frame {first + 1}'
        else:
            return
        raise GaitError(
            f'{self._parameters.motion_file}: frame {number}: {column}: '
            f'{"no value" if end is None or start is None else f"{end:g}"} is not accepted; '
            f'accepted: {wanted}'
        )


def frames_of(parameters: GaitParameters, plan: Plan | JointPlan) -> tuple[KeyFrames, str]:
    """Return the key frames of a planned motion, and the ``between`` that plays them."""
    if parameters.motion == 'file' or isinstance(plan, JointPlan):
        return read_key_frames(parameters.frames, parameters.motion_file), parameters.between
    paths = {'com_x': plan.com[0], 'com_y': plan.com[1], 'torso_roll': plan.torso_roll}
    for side, sole in plan.sole.items():
        for name in ('x', 'z', 'pitch'):
            paths[f'{side}_sole_{name}'] = getattr(sole, name)
    start = parameters.start_delay
    frames = merged({name: [(_since(start, t), v) for t, v in paths[name].keys] for name in FEET})
    smooth = any(isinstance(path, ClampedSpline) for path in plan.com)
    return frames, 'smooth' if smooth else 'rest'


def _since(start: float, time: float) -> float:
    """Return the duration that added to ``start`` is exactly ``time``; 0 before the start."""
    found = time - start
    near = (found, nextafter(found, inf), nextafter(found, -inf))
    return max(0.0, next((each for each in near if start + each == time), found))
