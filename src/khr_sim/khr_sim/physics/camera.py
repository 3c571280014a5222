"""What a picture of the world shows; a film is one per frame."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from khr_common.maths.rotation import Array, Vector

FIELD_OF_VIEW = 30.0  # deg, vertical
NEAR, FAR = 0.05, 10.0  # what is drawn, m from the camera
SUN = (-0.25, -0.5, 2.0)  # direction towards the light, in odom: shadows fall beside the feet


class Picture(NamedTuple):
    """What a camera sees: colours, (height, width, 3), and where that is the board."""

    colors: NDArray[np.uint8]
    board: NDArray[np.bool_]


@dataclass(frozen=True)
class Camera:
    """Where a camera stands, and how large its picture is.

    Attributes:
        width, height: of the picture, px.
        target: point looked at, m in odom.
        yaw: direction the camera looks in, rad about z from +x: 0 looks at the robot's back.
        pitch: rad; negative looks down.
        distance: from the target to the camera, m.
    """

    width: int
    height: int
    target: Vector
    yaw: float = -0.9
    pitch: float = -0.25
    distance: float = 1.0

    def view(self) -> Array:
        """Return the transform from odom to the camera's frame (x right, y up), (4, 4)."""
        ahead = np.array(
            (cos(self.pitch) * cos(self.yaw), cos(self.pitch) * sin(self.yaw), sin(self.pitch))
        )
        right = np.array((sin(self.yaw), -cos(self.yaw), 0.0))
        view = np.eye(4)
        view[:3, :3] = right, np.cross(right, ahead), -ahead
        view[:3, 3] = -view[:3, :3] @ (np.array(self.target) - self.distance * ahead)
        return view

    def projection(self) -> Array:
        """Return the transform from the camera's frame to that of the picture, (4, 4)."""
        scale = 1.0 / tan(radians(FIELD_OF_VIEW) / 2.0)
        depth = NEAR - FAR
        return np.array(
            (
                (scale * self.height / self.width, 0.0, 0.0, 0.0),
                (0.0, scale, 0.0, 0.0),
                (0.0, 0.0, (FAR + NEAR) / depth, 2.0 * FAR * NEAR / depth),
                (0.0, 0.0, -1.0, 0.0),
            )
        )

    def pixels(self, points: Array) -> Array:
        """Return where points in odom, m, (..., 3), are: px from left and from top, (..., 2)."""
        whole = np.concatenate((points, np.ones((*points.shape[:-1], 1))), axis=-1)
        seen = whole @ (self.projection() @ self.view()).T
        place = seen[..., :2] / seen[..., 3:]
        pixels: Array = (1.0 + place * (1.0, -1.0)) / 2.0 * (self.width, self.height)
        return pixels
