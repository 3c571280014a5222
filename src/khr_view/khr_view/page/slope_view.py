"""The slope under the robot, in viser's scene."""

from __future__ import annotations

from math import floor
from typing import Any

import numpy as np
from viser.transforms import SO3

from khr_view.model.snapshot import Snapshot

STRIPE = 0.1  # m between the lines of the slope
SIZE = (2.4, 1.0)  # m


class SlopeView:
    """The slope: it turns to its inclination, and follows the robot by whole stripes."""

    def __init__(self, scene: Any, root: str) -> None:
        self._scene = scene
        self._frame = scene.add_frame(f'{root}/board', show_axes=False)
        self._sheet = scene.add_frame(f'{root}/board/sheet', show_axes=False)
        width, height = SIZE
        name = f'{root}/board/sheet/top'
        scene.add_box(name, (238, 238, 236), (width, height, 0.01), position=(0.0, 0.0, -0.0055))
        scene.add_grid(
            f'{root}/board/sheet/grid',
            width,
            height,
            cell_size=STRIPE,
            cell_color=(205, 207, 210),
            section_size=5 * STRIPE,
            section_color=(150, 154, 160),
            shadow_opacity=0.0,
        )
        self._inclination, self._stripe = 0.0, 0

    def show(self, scene: Snapshot) -> None:
        """Turn and move the slope."""
        if scene.inclination != self._inclination:
            self._inclination = scene.inclination
            self._frame.wxyz = SO3.from_y_radians(scene.inclination).wxyz
        along = float(np.hypot(scene.way[0], scene.way[2])) * (1.0 if scene.way[0] > 0 else -1.0)
        stripe = floor(along / (5 * STRIPE) + 0.5)
        if stripe != self._stripe:
            self._stripe = stripe
            self._sheet.position = (stripe * 5 * STRIPE, 0.0, 0.0)
