"""Marks drawn with a robot: forces, centre of mass, support, path, pushes.

Marks that move in every frame are children of the robot's frames, or move as a whole: viser updates
poses at once, but shapes only some frames later.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr_bringup.balance import Balance
from khr_common.interfaces import REGIONS
from khr_common.rotation import Array
from khr_view.model.scene import Snapshot

Color = tuple[int, int, int]
LEFT, RIGHT, CENTER, SUPPORT, PATH, PUSH = (
    (0, 114, 178),
    (213, 94, 0),
    (204, 121, 167),
    (0, 158, 115),
    (230, 159, 0),
    (60, 64, 72),
)
# On the slope, colours as in the chart: centre of mass, capture point, centre of pressure.
POINTS = (('below', CENTER), ('capture', RIGHT), ('pressure', SUPPORT))
STEP = 0.005  # m of way between points of the path
LONGEST_PATH = 400  # points
CORNERS = 8  # of the support, at most: four of each sole
LEAST = 0.3  # N that are shown
ARROW = 0.008  # m of an arrow per N: the robot's weight is 12 cm
PUSH_ARROW = 0.01  # m per N
LINE = {'thickness': 2.0, 'thickness_units': 'screen'}
THIN = {'shaft_radius': 0.0025, 'head_radius': 0.006, 'head_length': 0.014}


class Marks:
    """The marks of one robot.

    Args:
        scene: viser's.
        at: name of the robot's node of the scene.
        frames: names of the nodes of its links.
    """

    def __init__(self, scene: Any, at: str, frames: Mapping[str, str]) -> None:
        self._arrows = [
            _arrow(scene, f'{frames[frame]}/force', LEFT if frame.startswith('l') else RIGHT)
            for frame in REGIONS.values()
        ]
        self._center = scene.add_icosphere(f'{at}/center_of_mass', 0.008, CENTER)
        self._points = [
            scene.add_icosphere(f'{at}/{name}', 0.007, color) for name, color in POINTS
        ]
        self._plumb = _lines(scene, f'{at}/center_of_mass/plumb', CENTER)
        self._support = _lines(scene, f'{at}/support', SUPPORT, CORNERS)
        self._path = _lines(scene, f'{at}/path', PATH)
        self._push = _arrow(scene, f'{at}/push', PUSH)
        self._push_label = scene.add_label(f'{at}/push_size', '', visible=False)
        self._visible = True
        self._trail: list[NDArray[np.float64]] = []
        self._depth = 0.0

    def show(self, scene: Snapshot) -> None:
        """Move all marks to their places in a scene."""
        for arrow, force in zip(self._arrows, scene.forces, strict=True):
            arrow.visible = self._visible and bool(np.linalg.norm(force) > LEAST)
            if arrow.visible:
                arrow.points = _between(np.zeros(3), ARROW * force)
        balance = scene.balance
        self._center.position = balance.center_of_mass
        self._show_points(balance)
        depth = float(balance.center_of_mass[2] - balance.below[2])
        if abs(depth - self._depth) > STEP:
            self._depth = depth
            self._plumb.points = _between(np.zeros(3), np.array([0.0, 0.0, -depth]))
        self._support.points = outline(balance.support)
        self._walk(scene.way)

    def _show_points(self, balance: Balance) -> None:
        for ball, place in zip(
            self._points, (balance.below, balance.capture, balance.pressure), strict=True
        ):
            known = bool(np.isfinite(place).all())
            ball.visible = self._visible and known
            if known:
                ball.position = np.add(place, (0.0, 0.0, 0.002))

    def show_push(self, scene: Snapshot, force: NDArray[np.float64]) -> None:
        """Show a push that acts or is being dragged, N in odom; a zero one hides it."""
        size = float(np.linalg.norm(force))
        self._push.visible = self._push_label.visible = size > 0.0
        if size > 0.0:
            start = scene.torso - force * PUSH_ARROW
            self._push.points = _between(start, scene.torso)
            self._push_label.position = start
            self._push_label.text = f'{size:.1f} N'

    def show_all(self, visible: bool) -> None:
        """Show or hide all but pushes."""
        self._visible = visible
        for mark in (
            *self._arrows,
            self._center,
            *self._points,
            self._plumb,
            self._support,
            self._path,
        ):
            mark.visible = visible

    def _walk(self, way: NDArray[np.float64]) -> None:
        if self._trail:
            gone = float(np.linalg.norm(way - self._trail[-1]))
            if gone < STEP:
                return
            if gone > 20 * STEP:
                self._trail.clear()  # a new run
                self._path.points = np.zeros((1, 2, 3), dtype=np.float32)
        self._trail.append(way)
        del self._trail[:-LONGEST_PATH]
        if len(self._trail) > 1:
            points = np.add(self._trail, (0.0, 0.0, 0.001))
            self._path.points = np.stack([points[:-1], points[1:]], axis=1).astype(np.float32)


def outline(corners: Array) -> NDArray[np.float32]:
    """Return the edges of a polygon with at most 8 corners, padded to 8 with points: (8, 2, 3)."""
    if not len(corners):
        return np.zeros((CORNERS, 2, 3), dtype=np.float32)
    raised = np.add(corners, (0.0, 0.0, 0.0015))
    around = raised[np.minimum(np.arange(CORNERS + 1), len(raised)) % len(raised)]
    return np.stack([around[:-1], around[1:]], axis=1).astype(np.float32)


def linear(color: Color) -> NDArray[np.uint8]:
    """Convert a colour from sRGB to linear RGB, as viser expects for arrows."""
    share = np.array(color) / 255.0
    light = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
    return np.rint(255.0 * light).astype(np.uint8)


def _arrow(scene: Any, name: str, color: Color) -> Any:
    return scene.add_arrows(name, np.zeros((1, 2, 3)), linear(color), visible=False, **THIN)


def _lines(scene: Any, name: str, color: Color, count: int = 1) -> Any:
    return scene.add_line_segments(name, np.zeros((count, 2, 3)), color, **LINE)


def _between(start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float32]:
    return np.array([[start, end]], dtype=np.float32)
