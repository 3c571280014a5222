"""Images of the robot on a striped slope, by the software renderer of PyBullet."""

from __future__ import annotations

import numpy as np

from khr_common.rotation import matrix, pitched
from khr_description.robot import Robot, dressed
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.camera import SUN, Camera, Picture
from khr_sim.physics.engines.bullet import Bullet, bullet

STRIPE = 0.05  # m, along the slope
HALF_WIDTH, THICKNESS = 0.18, 0.015  # m
RING = 1.0  # m, half the width under several robots
STRIPES = 56  # enough for the widest image
COLORS = ((0.92, 0.90, 0.85, 1.0), (0.85, 0.82, 0.75, 1.0))


class BulletScene(Bullet):
    """A scene for rendering: the robot takes recorded poses, and the slope follows the camera."""

    def __init__(self, parameters: SimulatorParameters, robot: Robot, robots: int = 1) -> None:
        super().__init__(parameters, robot, robots)
        if robots > 1:
            self._urdfs[0] = dressed(self._urdfs[0], 'red')

    def reset(self, inclination: float) -> None:
        """Restart on ground inclined by an angle in rad."""
        super().reset(inclination)
        bullet.removeBody(self.ground, self.client)
        self._stripes = [self._stripe(number) for number in range(STRIPES)]
        self.tilt_ground(inclination)

    def tilt_ground(self, inclination: float) -> None:
        """Incline the slope about the origin by an angle in rad."""
        self._inclination = inclination

    def picture(self, camera: Camera) -> Picture:
        """Render the image of a camera."""
        self._move_slope(camera.target[0])
        _, _, pixels, _, bodies = bullet.getCameraImage(
            camera.width,
            camera.height,
            camera.view().T.ravel().tolist(),
            camera.projection().T.ravel().tolist(),
            lightDirection=SUN,
            lightAmbientCoeff=0.75,
            lightDiffuseCoeff=0.3,
            lightSpecularCoeff=0.05,
            shadow=0,  # shadows take four times as long
            renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        shape = (camera.height, camera.width)
        colors = np.reshape(np.asarray(pixels, np.uint8), (*shape, 4))[:, :, :3]
        slope = np.isin(np.reshape(bodies, shape), self._stripes)
        return Picture(np.ascontiguousarray(colors), slope)

    def _stripe(self, number: int) -> int:
        half_width = HALF_WIDTH if len(self.bodies) == 1 else RING
        shape = bullet.createVisualShape(
            bullet.GEOM_BOX,
            halfExtents=(STRIPE / 2.0, half_width, THICKNESS / 2.0),
            visualFramePosition=((number - STRIPES / 2.0 + 0.5) * STRIPE, 0.0, -THICKNESS / 2.0),
            rgbaColor=COLORS[number % 2],
            physicsClientId=self.client,
        )
        return int(bullet.createMultiBody(0.0, -1, shape, physicsClientId=self.client))

    def _move_slope(self, x: float) -> None:
        """Shift the slope by pairs of stripes, so that its ends stay out of the image."""
        turn = pitched(self._inclination)
        along = matrix(turn)[:, 0]
        place = round(x / along[0] / (2.0 * STRIPE)) * 2.0 * STRIPE * along
        for stripe in self._stripes:
            bullet.resetBasePositionAndOrientation(stripe, place.tolist(), turn, self.client)
