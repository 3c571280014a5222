"""A planned motion: paths of soles, centre of mass and torso in the stance plane, or of joints.

The frame of the plane has x forward, y to the left and z along the normal, with the origin midway
between the centres of the soles in the first stance. Paths map (N,) times to (N, ...) arrays.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from khr_balance.gaits.kinematics import HIP_DROP, SOLE_DROP, TOE_X
from khr_balance.gaits.splines import Path
from khr_common.rotation import Array

SAMPLE, RAISED = 0.005, 0.0005  # s between samples, and m from which on a foot is in the air


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
