"""A planned motion: paths of soles, centre of mass and torso in the stance plane, or of joints.

SciPy has splines too, but its import takes 0.5 s in every process that plans a motion.

The frame of the plane has x forward, y to the left and z along the normal, with the origin midway
between the centres of the soles in the first stance. Paths map (N,) times to (N, ...) arrays.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from khr_balance.gaits.kinematics import HIP_DROP, SOLE_DROP, TOE_X
from khr_common.rotation import Array

SAMPLE, RAISED = 0.005, 0.0005  # s between samples, and m from which on a foot is in the air

Keys = list[tuple[float, float]]


class ClampedSpline:
    """The cubic spline through all values with zero slope at both ends, C2.

    Args:
        times: at least two, increasing, (N,).
        values: at these times, (N,) or (N, n).

    Attributes:
        slopes: at the times, (N,) or (N, n).
        pieces: coefficients of each interval, cubic first, in the time since its start,
            (N - 1, 4) or (N - 1, 4, n).
    """

    def __init__(self, times: Sequence[float] | Array, values: Sequence[float] | Array) -> None:
        self._times, places = np.asarray(times, dtype=float), np.asarray(values, dtype=float)
        self._places = places
        step = np.diff(self._times).reshape(-1, *[1] * (places.ndim - 1))
        mean = np.diff(places, axis=0) / step
        self.slopes = _slopes(np.diff(self._times).tolist(), mean)
        first, last = self.slopes[:-1], self.slopes[1:]
        self.pieces = np.stack(
            [
                (first + last - 2.0 * mean) / step**2,
                (3.0 * mean - 2.0 * first - last) / step,
                first,
                places[:-1],
            ],
            axis=1,
        )

    @property
    def keys(self) -> Keys:
        """Return the times and positions that it passes."""
        return list(zip(self._times.tolist(), self._places.tolist(), strict=True))

    def __call__(self, time: Array) -> Array:
        """Return the values (M,) or (M, n) at times (M,), constant beyond both ends."""
        time = np.clip(time, self._times[0], self._times[-1])
        piece = _piece(self._times, time)
        t = time - self._times[piece]
        cubic, square, slope, place = (part.T for part in np.moveaxis(self.pieces[piece], 1, 0))
        found: Array = (((cubic * t + square) * t + slope) * t + place).T
        return found


class RestingPath:
    """The minimum-jerk path that rests at every position: quintics, C2.

    Args:
        times: increasing, (N,); a single one is a rest.
        places: positions at these times, (N,).
    """

    def __init__(self, times: Sequence[float], places: Sequence[float]) -> None:
        self._times, self._places = np.array(times, dtype=float), np.array(places, dtype=float)

    @property
    def keys(self) -> Keys:
        """Return the times and positions that it passes."""
        return list(zip(self._times.tolist(), self._places.tolist(), strict=True))

    def __call__(self, time: Array) -> Array:
        """Return the positions (M,) at times (M,), constant beyond both ends."""
        if len(self._times) == 1:
            return np.full(len(time), self._places[0])
        piece = _piece(self._times, time)
        span, way = np.diff(self._times)[piece], np.diff(self._places)[piece]
        u = np.clip((time - self._times[piece]) / span, 0.0, 1.0)
        found: Array = self._places[piece] + way * u**3 * (10.0 + u * (6.0 * u - 15.0))
        return found


Path = ClampedSpline | RestingPath


def constant_path(place: float) -> Path:
    """Return a path that stays in one place."""
    return RestingPath((0.0,), (place,))


def _piece(times: Array, time: Array) -> NDArray[np.intp]:
    """Return the index of the interval that contains each time."""
    return np.clip(np.searchsorted(times, time, side='right') - 1, 0, len(times) - 2)


def _slopes(step: Sequence[float], mean: Array) -> Array:
    """Return the slopes for a continuous second derivative, 0 at both ends.

    The equations are tridiagonal: one forward and one backward pass solve them.

    Args:
        step: length of each interval, (N - 1,).
        mean: mean slope of each interval, (N - 1, ...).
    """
    slopes = np.zeros((len(step) + 1, *mean.shape[1:]))
    passed, factors = 0.0, [0.0]
    for i in range(1, len(step)):
        before, after = 1.0 / step[i - 1], 1.0 / step[i]
        pivot = 2.0 * (before + after) - before * passed
        passed = after / pivot
        factors.append(passed)
        known = 3.0 * (before * mean[i - 1] + after * mean[i])
        slopes[i] = (known - before * slopes[i - 1]) / pivot
    for i in range(len(step) - 1, 0, -1):
        slopes[i] -= factors[i] * slopes[i + 1]
    return slopes


@dataclass(frozen=True)
class Sole:
    """The path of a sole: position of the flat sole, and pitch on its toe.

    Attributes:
        x, z: position of the centre of a flat sole with the same toe, m.
        y: lateral position, m.
        pitch: toe down, rad; never negative, so that z is the height of the lowest point.
    """

    y: float
    x: Path
    z: Path
    pitch: Path

    def centre(self, time: Array) -> Array:
        """Return the (N, 3) centre of the sole."""
        pitch = self.pitch(time)
        return np.column_stack(
            [
                self.x(time) + TOE_X * (1.0 - np.cos(pitch)),
                np.full(len(time), self.y),
                self.z(time) + TOE_X * np.sin(pitch),
            ]
        )

    def normal(self, time: Array) -> Array:
        """Return the (N, 3) normal of the sole."""
        pitch = self.pitch(time)
        return np.column_stack([np.sin(pitch), np.zeros(len(time)), np.cos(pitch)])


@dataclass(frozen=True)
class Plan:
    """The planned paths of soles, centre of mass and torso.

    Attributes:
        duration: s.
        sole: path of each sole, by side.
        com: ground projection of the centre of mass, x and y, m.
        torso_roll, torso_pitch: attitude of the torso, rolled first, then pitched, rad.
        hip_height: hip-pitch axes above ankle-pitch axes while the torso is upright, m.
        cycles: start and end of each whole cycle of a walk, s.
        frames: time (s) and number of each key frame of a file.
    """

    duration: float
    sole: dict[str, Sole]
    com: tuple[Path, Path]
    torso_roll: Path
    torso_pitch: float
    hip_height: float
    cycles: tuple[tuple[float, float], ...] = ()
    frames: tuple[tuple[float, int], ...] = ()

    def swings(self, side: str) -> list[tuple[float, float]]:
        """Return when a foot is in the air: start and end of each time, s."""
        time = np.arange(0.0, self.duration, SAMPLE)
        raised = np.diff(self.sole[side].z(time) > RAISED, prepend=False, append=False)
        return [
            (float(start), float(end))
            for start, end in SAMPLE * np.flatnonzero(raised).reshape(-1, 2)
        ]

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
        """Return the (N,) height of the torso's origin above the plane of the soles."""
        return self.hip_height + HIP_DROP + SOLE_DROP + HIP_DROP * self.torso(time)[:, 2, 2]


@dataclass(frozen=True)
class JointPlan:
    """The planned joint angles; joints without a path keep the angles of the stance.

    Attributes:
        duration, cycles, frames: as of :class:`Plan`.
        angles: path of each joint by name, rad.
    """

    duration: float
    angles: Mapping[str, Path]
    cycles: tuple[tuple[float, float], ...] = ()
    frames: tuple[tuple[float, int], ...] = ()

    def swings(self, side: str) -> list[tuple[float, float]]:
        """Return no swings: joint angles do not say when a foot is in the air."""
        return []
