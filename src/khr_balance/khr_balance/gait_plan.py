"""Plan a motion in the stance plane: paths of the soles, the centre of mass and the torso.

The plane's frame has x along the way, y to the left and z along its normal, the origin midway
between the soles' centres of the first stance. Paths take (N,) times and give (N, ...) arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BPoly, CubicSpline

from khr_balance.body import HIP_DROP, SOLE_DROP, TOE_X, Array
from khr_balance.gait_parameters import GaitParameters

Path = Callable[[Array], Array]


class Key(NamedTuple):
    """A place to be at a time."""

    time: float
    place: float


@dataclass(frozen=True)
class Sole:
    """The path of a sole: where its centre is while it is flat, and how it tips on its toe.

    Attributes:
        x, z: place of the centre if the sole were flat with its toe where it is, m.
        y: m.
        pitch: toe down, rad; never negative, so that z is the height of its lowest point.
    """

    y: float
    x: Path
    z: Path
    pitch: Path

    def centre(self, time: Array) -> Array:
        """Give the (N, 3) centre of the sole."""
        pitch = self.pitch(time)
        return np.column_stack([self.x(time) + TOE_X * (1.0 - np.cos(pitch)),
                                np.full(len(time), self.y),
                                self.z(time) + TOE_X * np.sin(pitch)])

    def normal(self, time: Array) -> Array:
        """Give the (N, 3) normal of the sole."""
        pitch = self.pitch(time)
        return np.column_stack([np.sin(pitch), np.zeros(len(time)), np.cos(pitch)])


@dataclass(frozen=True)
class Plan:
    """Where everything shall be.

    Attributes:
        duration: s.
        sole: per side the path of the sole.
        com: ground projection of the centre of mass, x and y, m.
        torso_roll, torso_pitch: attitude of the torso, rolled first, then pitched, rad.
        hip_height: hip-pitch axes above ankle-pitch axes while the torso is upright, m.
        cycles: start and end of each whole cycle of a walk, s.
    """

    duration: float
    sole: dict[str, Sole]
    com: tuple[Path, Path]
    torso_roll: Path
    torso_pitch: float
    hip_height: float
    cycles: tuple[tuple[float, float], ...] = ()

    def centre_of_mass(self, time: Array) -> Array:
        """Give the (N, 2) ground projection of the centre of mass."""
        return np.column_stack([path(time) for path in self.com])

    def torso(self, time: Array) -> Array:
        """Give the (N, 3, 3) attitude of the torso."""
        roll, pitch = self.torso_roll(time), np.full(len(time), self.torso_pitch)
        zero, one = np.zeros_like(roll), np.ones_like(roll)
        c, s, cp, sp = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch)
        about_x = np.array([[one, zero, zero], [zero, c, -s], [zero, s, c]])
        about_y = np.array([[cp, zero, sp], [zero, one, zero], [-sp, zero, cp]])
        attitude: Array = np.einsum('ijn,jkn->nik', about_y, about_x)
        return attitude

    def torso_height(self, time: Array) -> Array:
        """Give the (N,) height of the torso's origin above the soles' plane."""
        return self.hip_height + HIP_DROP + SOLE_DROP + HIP_DROP * self.torso(time)[:, 2, 2]


def plan_motion(parameters: GaitParameters) -> Plan:
    """Plan the motion that the parameters ask for."""
    return {'stand': _stand, 'walk': _walk, 'leg_lift': _leg_lift}[parameters.motion](parameters)


def _still(place: float) -> Path:
    return lambda time: np.full(len(time), place)


def _rests(keys: Sequence[Key]) -> Path:
    """Move from rest to rest through every key: quintics of least jerk, C2."""
    times = [key.time for key in keys]
    path = BPoly.from_derivatives(times, [[key.place, 0.0, 0.0] for key in keys], orders=5)
    return lambda time: np.asarray(path(np.clip(time, times[0], times[-1])), dtype=np.float64)


def _flows(keys: Sequence[Key]) -> Path:
    """Move through the keys without stopping, from rest to rest: a cubic spline, C2."""
    times = [key.time for key in keys]
    path = CubicSpline(times, [key.place for key in keys], bc_type='clamped')
    return lambda time: np.asarray(path(np.clip(time, times[0], times[-1])), dtype=np.float64)


def _stand(p: GaitParameters) -> Plan:
    half = p.foot_spread / 2.0
    return Plan(
        duration=p.start_delay + p.end_pause,
        sole={'l': Sole(half, _still(0.0), _still(0.0), _still(0.0)),
              'r': Sole(-half, _still(0.0), _still(0.0), _still(0.0))},
        com=(_still(p.com_stance), _still(0.0)), torso_roll=_still(0.0),
        torso_pitch=p.torso_pitch, hip_height=p.hip_height)


def _leg_lift(p: GaitParameters) -> Plan:
    """Shift the weight over one leg, lift the other, hold, set down, shift back (chapter 3)."""
    durations = (p.shift_time, p.lift_time, p.hold_time, p.lift_time, p.shift_time)
    shifted, up, down, back, end = (p.start_delay + np.cumsum(durations)).tolist()
    stance_side = 1.0 if p.first_foot == 'right' else -1.0
    half = p.foot_spread / 2.0

    def shift(place: float) -> Path:
        return _rests([Key(p.start_delay, 0.0), Key(shifted, place), Key(back, place),
                       Key(end, 0.0)])

    def raised(side: str) -> Path:
        if side != p.first_foot[0]:
            return _still(0.0)
        return _rests([Key(shifted, 0.0), Key(up, p.lift), *_unless_empty(up, down, p.lift),
                       Key(back, 0.0)])

    return Plan(
        duration=end + p.end_pause,
        sole={'l': Sole(half, _still(0.0), raised('l'), _still(0.0)),
              'r': Sole(-half, _still(0.0), raised('r'), _still(0.0))},
        com=(_still(p.com_stance), shift(stance_side * (half - p.lift_com_inboard))),
        torso_roll=shift(-stance_side * p.lift_torso_roll),
        torso_pitch=p.torso_pitch, hip_height=p.hip_height)


def _unless_empty(start: float, end: float, place: float) -> list[Key]:
    return [Key(end, place)] if end > start else []


def _walk(p: GaitParameters) -> Plan:
    """Walk straight: half a cycle, the whole cycles, half a cycle, stance to stance.

    Half a cycle is one step. The first step takes one foot a stride ahead, every other step takes
    the rear foot past the front one, and the last brings it alongside.
    """
    steps = 2 * p.cycles + 2
    step_time = p.cycle_period / 2.0
    ends = step_time * np.cumsum(p.phases) / sum(p.phases)
    lift_off, high, over, down = ends[:4].tolist()
    middle = (lift_off + down) / 2.0
    speed = p.stride / step_time
    half = p.foot_spread / 2.0
    place = {'l': 0.0, 'r': 0.0}
    forward = {side: [Key(0.0, 0.0)] for side in place}
    upward = {side: [Key(0.0, 0.0)] for side in place}
    tipping = {side: [Key(0.0, 0.0)] for side in place}
    com_x, com_y = [Key(p.start_delay, p.com_stance)], [Key(p.start_delay, 0.0)]
    swing = p.first_foot[0]
    for step in range(steps):
        start = p.start_delay + step * step_time
        stance = 'r' if swing == 'l' else 'l'
        last = step == steps - 1
        here, before = place[stance], place[swing]
        place[swing] = here + (0.0 if last else p.stride)
        forward[swing] += [Key(start + lift_off, before), Key(start + down, place[swing])]
        upward[swing] += [Key(start + lift_off, 0.0), Key(start + high, p.lift),
                          Key(start + over, p.lift), Key(start + down, 0.0)]
        com_x += [Key(start + at, here + p.com_ahead + (at - middle) * speed)
                  for at in (lift_off, middle, down)[step == 0:1 if last else 3]]
        if step > 0:
            tipping[swing] += [Key(start, 0.0), Key(start + lift_off, p.heel_off),
                               Key(start + over, 0.0)]
        side = 1.0 if stance == 'l' else -1.0
        com_y += [Key(start + at, side * p.sway * np.sin(np.pi * at / step_time))
                  for at in (lift_off, middle, down)] + [Key(start + step_time, 0.0)]
        swing = stance
    finish = p.start_delay + steps * step_time
    com_x.append(Key(finish, place['l'] + p.com_stance))
    return Plan(
        duration=finish + p.end_pause,
        sole={'l': Sole(half, *(_rests(keys['l']) for keys in (forward, upward, tipping))),
              'r': Sole(-half, *(_rests(keys['r']) for keys in (forward, upward, tipping)))},
        com=(_flows(com_x), _flows(com_y)), torso_roll=_still(0.0),
        torso_pitch=p.torso_pitch, hip_height=p.hip_height,
        cycles=tuple((p.start_delay + (2 * cycle + 1) * step_time,
                      p.start_delay + (2 * cycle + 3) * step_time) for cycle in range(p.cycles)))
