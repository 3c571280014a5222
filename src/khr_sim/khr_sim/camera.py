"""Pictures of the world, drawn in software; a film is one per frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from khr_sim.engine import bullet
from khr_sim.world import World

FIELD_OF_VIEW = 30.0  # deg, vertical
SUN = (0.6, 0.8, 1.5)  # direction towards the light, in odom


def render(
    world: World,
    width: int,
    height: int,
    *,
    yaw: float = -0.9,
    pitch: float = -0.25,
    distance: float = 1.0,
    target: Sequence[float] | None = None,
) -> NDArray[np.uint8]:
    """Return a picture of the robot, shape (height, width, 3), RGB.

    Args:
        world: the world to look at.
        width: of the picture, in pixels.
        height: of the picture, in pixels.
        yaw: direction the camera looks in, rad about z from +x: 0 looks at the robot's back.
        pitch: of the camera, rad; negative looks down.
        distance: from the target to the camera, m.
        target: point looked at, m in odom; the robot's middle if not given.
    """
    if target is None:
        position, _ = bullet.getBasePositionAndOrientation(world.body, world.client)
        target = (position[0], position[1], position[2] - 0.08)
    view = bullet.computeViewMatrixFromYawPitchRoll(
        target, distance, np.degrees(yaw) - 90.0, np.degrees(pitch), 0.0, 2
    )
    projection = bullet.computeProjectionMatrixFOV(FIELD_OF_VIEW, width / height, 0.05, 10.0)
    _, _, pixels, _, _ = bullet.getCameraImage(
        width,
        height,
        view,
        projection,
        lightDirection=SUN,
        shadow=1,
        renderer=bullet.ER_TINY_RENDERER,
        physicsClientId=world.client,
    )
    picture = np.reshape(np.asarray(pixels, dtype=np.uint8), (height, width, 4))
    return np.ascontiguousarray(picture[:, :, :3])
