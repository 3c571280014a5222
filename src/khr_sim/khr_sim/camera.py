"""What a picture of the world shows; a film is one per frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from khr_common.rotation import Vector

Picture = NDArray[np.uint8]  # shape (height, width, 3), RGB

FIELD_OF_VIEW = 30.0  # deg, vertical
NEAR, FAR = 0.05, 10.0  # what is drawn, m from the camera
SUN = (0.6, 0.8, 1.5)  # direction towards the light, in odom


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
