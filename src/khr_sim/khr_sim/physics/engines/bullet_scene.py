"""Pictures of the robot on a striped board, by PyBullet's software renderer."""

from __future__ import annotations

import numpy as np

from khr_common.maths.rotation import matrix, pitched
from khr_sim.physics.camera import SUN, Camera, Picture
from khr_sim.physics.engines.bullet import Bullet, bullet

STRIPE = 0.05  # m, of the board, along it
HALF_WIDTH, THICKNESS = 0.18, 0.015  # m
STRIPES = 56  # enough for the widest picture
COLORS = ((0.92, 0.90, 0.85, 1.0), (0.85, 0.82, 0.75, 1.0))


class BulletScene(Bullet):
    """A scene to look at: the robot takes poses, and the board lies wherever the camera looks."""

    def reset(self, inclination: float) -> None:
        """Start anew, with a ground inclined by so many rad."""
        super().reset(inclination)
        bullet.removeBody(self.ground, self.client)
        self._board = [self._stripe(number) for number in range(STRIPES)]
        self.tilt_ground(inclination)

    def tilt_ground(self, inclination: float) -> None:
        """Incline the board by so many rad about the origin."""
        self._inclination = inclination

    def picture(self, camera: Camera) -> Picture:
        """Draw what a camera sees."""
        self._move_board(camera.target[0])
        _, _, pixels, _, bodies = bullet.getCameraImage(
            camera.width,
            camera.height,
            camera.view().T.ravel().tolist(),
            camera.projection().T.ravel().tolist(),
            lightDirection=SUN,
            lightAmbientCoeff=0.75,
            lightDiffuseCoeff=0.3,
            lightSpecularCoeff=0.05,
            shadow=0,  # it would take four times as long
            renderer=bullet.ER_TINY_RENDERER,
            physicsClientId=self.client,
        )
        shape = (camera.height, camera.width)
        colors = np.reshape(np.asarray(pixels, np.uint8), (*shape, 4))[:, :, :3]
        board = np.isin(np.reshape(bodies, shape), self._board)
        return Picture(np.ascontiguousarray(colors), board)

    def _stripe(self, number: int) -> int:
        shape = bullet.createVisualShape(
            bullet.GEOM_BOX,
            halfExtents=(STRIPE / 2.0, HALF_WIDTH, THICKNESS / 2.0),
            visualFramePosition=((number - STRIPES / 2.0 + 0.5) * STRIPE, 0.0, -THICKNESS / 2.0),
            rgbaColor=COLORS[number % 2],
            physicsClientId=self.client,
        )
        return int(bullet.createMultiBody(0.0, -1, shape, physicsClientId=self.client))

    def _move_board(self, x: float) -> None:
        """Let the board end nowhere in the picture: move it along itself by pairs of stripes."""
        turn = pitched(self._inclination)
        along = matrix(turn)[:, 0]
        place = round(x / along[0] / (2.0 * STRIPE)) * 2.0 * STRIPE * along
        for stripe in self._board:
            bullet.resetBasePositionAndOrientation(stripe, place.tolist(), turn, self.client)
