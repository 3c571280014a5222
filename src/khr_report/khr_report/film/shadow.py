"""The shadow of the robot on its slope: each box of its description, thrown along the light."""

from __future__ import annotations

from itertools import product

import numpy as np
from PIL import Image, ImageChops, ImageDraw

from khr_common.rotation import Array, matrix, pitched
from khr_description.robot import Robot, vector
from khr_sim.physics.camera import SUN, Camera
from khr_sim.physics.truth import GroundTruth

# The corners of a box, and the faces by the numbers of their corners, in order around each.
CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
SHADE = 0.8  # of the light that is left


class Shadow:
    """Shadow of the robot; a renderer's own shadows take four times as long as the picture."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._boxes: list[tuple[str, Array]] = []
        for link in robot.xml.iter('link'):
            for visual in link.findall('visual'):
                box, origin = visual.find('geometry/box'), visual.find('origin')
                if box is not None:
                    corners = vector(origin, 'xyz') + CORNERS * vector(box, 'size')
                    self._boxes.append((link.attrib['name'], corners))

    def on_slope(self, truth: GroundTruth) -> Array:
        """Return the corners of all boxes thrown onto the slope, m in odom, (boxes, 8, 3)."""
        poses = self._robot.poses(truth.joint_position)
        turn, place = matrix(truth.orientation), np.asarray(truth.position)
        corners = np.array(
            [corners @ poses[link][:3, :3].T + poses[link][:3, 3] for link, corners in self._boxes]
        )
        corners = corners @ turn.T + place
        normal, sun = matrix(pitched(truth.inclination))[:, 2], np.array(SUN)
        thrown: Array = corners - (corners @ normal / (sun @ normal))[..., None] * sun
        return thrown

    def darken(
        self, picture: Image.Image, slope: Image.Image, truth: GroundTruth, camera: Camera
    ) -> None:
        """Darken the part of the slope in the shadow.

        Args:
            picture: to draw into.
            slope: white where the picture shows the slope.
            truth: where the robot is.
            camera: of the picture.
        """
        shadow = Image.new('L', picture.size)
        pen = ImageDraw.Draw(shadow)
        for box in camera.pixels(self.on_slope(truth)):
            for face in FACES:
                pen.polygon([tuple(box[corner]) for corner in face], 255)
        dark = picture.point(lambda value: round(value * SHADE))
        picture.paste(dark, (0, 0), ImageChops.logical_and(shadow.convert('1'), slope))
