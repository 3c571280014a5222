"""Camera model of the rendered images."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians, sin, tan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from khr_common.rotation import Array, Vector

FIELD_OF_VIEW = 30.0  # deg, vertical
NEAR, FAR = 0.05, 10.0  # clipping planes, m from the camera
SUN = (-0.25, -0.5, 2.0)  # direction to the light, in odom; shadows fall to the side of the feet


class Picture(NamedTuple):
    """A rendered image."""

    colors: NDArray[np.uint8]  # RGB, (height, width, 3)
    slope: NDArray[np.bool_]  # mask of the pixels that show the slope, (height, width)


@dataclass(frozen=True)
class Camera:
    """Pose and image size of a camera."""

    # width, height: of the image, px
    width: int
    height: int
    target: Vector  # point in the image centre, m in odom
    yaw: float = -0.9  # viewing direction, rad about z from +x; 0 looks at the back of the robot
    pitch: float = -0.25  # rad; negative looks down
    distance: float = 1.0  # from the target to the camera, m

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
        """Return the projection from the camera frame to clip coordinates, (4, 4)."""
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
        """Project points in odom, m, (..., 3), to the image: px from left and top, (..., 2)."""
        whole = np.concatenate((points, np.ones((*points.shape[:-1], 1))), axis=-1)
        seen = whole @ (self.projection() @ self.view()).T
        place = seen[..., :2] / seen[..., 3:]
        pixels: Array = (1.0 + place * (1.0, -1.0)) / 2.0 * (self.width, self.height)
        return pixels
