"""The robot on its board, in viser's scene."""

from __future__ import annotations

from collections.abc import Callable
from math import floor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr_common.interfaces import BODY, JOINTS
from khr_common.rotation import Array, pitched, quaternion, rotated
from khr_sim.robot import Robot
from khr_view.events import Pushed
from khr_view.shapes import Shape, shapes
from khr_view.snapshot import Snapshot

Color = tuple[int, int, int]
INK, LEFT, RIGHT, CENTER, SUPPORT, PATH, PUSH = (
    (60, 64, 72),
    (0, 114, 178),
    (213, 94, 0),
    (204, 121, 167),
    (0, 158, 115),
    (230, 159, 0),
    (213, 94, 0),
)
STRIPE = 0.1  # m between the lines of the board
BOARD = (2.4, 1.0)  # m
STEP = 0.005  # m of way between points of the path
LONGEST_PATH = 400  # points
CORNERS = 8  # of the support, at most: four of each sole
PUSH_ARROW = 0.01  # m per N
DRAG, LARGEST_DRAG = 100.0, 0.3  # N per m that the torso is dragged, and m that count


class BoardView:
    """The board: it turns to its inclination, and goes along with the robot in whole stripes."""

    def __init__(self, scene: Any, root: str) -> None:
        self._scene = scene
        self._frame = scene.add_frame(f'{root}/board', show_axes=False)
        self._sheet = scene.add_frame(f'{root}/board/sheet', show_axes=False)
        width, height = BOARD
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
        """Turn and move the board."""
        if scene.inclination != self._inclination:
            self._inclination = scene.inclination
            self._frame.wxyz = _wxyz(pitched(scene.inclination))
        along = float(np.hypot(scene.way[0], scene.way[2])) * (1.0 if scene.way[0] > 0 else -1.0)
        stripe = floor(along / (5 * STRIPE) + 0.5)
        if stripe != self._stripe:
            self._stripe = stripe
            self._sheet.position = (stripe * 5 * STRIPE, 0.0, 0.0)


class RobotView:
    """One robot, with the forces on it, its centre of mass, its support and its path.

    Args:
        scene: viser's.
        root: name of the scene's node under which it stands.
        name: its own, among those under the root.
        robot: its description.
        shift: where it stands beside its true place, m, (3,).
        ghost: whether it is shown pale, beside another one.
    """

    def __init__(
        self,
        scene: Any,
        root: str,
        name: str,
        robot: Robot,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
        ghost: bool = False,
    ) -> None:
        self._scene, self._at = scene, f'{root}/{name}'
        self.frame = scene.add_frame(self._at, show_axes=False, position=shift)
        self._opacity = 0.45 if ghost else None
        self._joints: dict[str, Any] = {}
        self._names = self._add_frames(robot)
        self._torso: list[Any] = []  # what can be grasped
        for number, shape in enumerate(shapes(robot)):
            self._add_shape(number, shape)
        self._add_marks()
        self._trail: list[NDArray[np.float64]] = []
        self._last: tuple[float, ...] = ()

    def show(self, scene: Snapshot) -> None:
        """Move all to where it is at an instant."""
        self._base.position = scene.base[:3]
        self._base.wxyz = _wxyz(scene.base[3:])
        for index, name in enumerate(JOINTS):
            angle = scene.joints[index]
            if not self._last or angle != self._last[index]:
                frame, axis = self._joints[name]
                frame.wxyz = _wxyz(rotated(angle * axis))
        self._last = scene.joints
        self._arrows.points = scene.forces.astype(np.float32)
        self._center.position = scene.center_of_mass
        self._below.position = scene.below
        self._plumb.points = np.array([[scene.center_of_mass, scene.below]], dtype=np.float32)
        self._support.points = outline(scene.support)
        self._walk(scene)

    def tilt(self, angle: float) -> None:
        """Turn all of it about the board's axis, rad: from the board it stands on to another."""
        self.frame.wxyz = _wxyz(pitched(angle))

    def show_push(self, scene: Snapshot, force: NDArray[np.float64]) -> None:
        """Show a push that acts or is being dragged, N in odom; a zero one hides it."""
        size = float(np.linalg.norm(force))
        self._push.visible = self._push_label.visible = size > 0.0
        if size > 0.0:
            start = scene.torso - force * PUSH_ARROW
            self._push.points = np.array([[start, scene.torso]], dtype=np.float32)
            self._push_label.position = start
            self._push_label.text = f'{size:.1f} N'

    def on_drag(self, emit: Callable[[object], None]) -> None:
        """Report pushes that are aimed by dragging the torso, and given at the drag's end."""

        async def dragged(event: Any) -> None:
            way = np.subtract(event.end_position, event.start_position)
            force = way * DRAG * min(1.0, LARGEST_DRAG / max(float(np.linalg.norm(way)), 1e-9))
            emit(Pushed(tuple(force.tolist()), event.phase == 'end'))

        for handle in self._torso:
            handle.on_drag('left')(dragged)

    def show_marks(self, visible: bool) -> None:
        """Show or hide what is computed: forces, centre of mass, support and path."""
        for mark in self._marks:
            mark.visible = visible

    def _walk(self, scene: Snapshot) -> None:
        way = scene.way
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

    def _add_frames(self, robot: Robot) -> dict[str, str]:
        names = {BODY: f'{self._at}/{BODY}'}
        self._base = self._scene.add_frame(names[BODY], show_axes=False)
        for joint in robot.joints.values():
            names[joint.child] = f'{names[joint.parent]}/{joint.child}'
            frame = self._scene.add_frame(
                names[joint.child], show_axes=False, position=joint.origin
            )
            if joint.name in JOINTS:
                self._joints[joint.name] = frame, joint.axis
        return names

    def _add_shape(self, number: int, shape: Shape) -> None:
        name = f'{self._names[shape.link]}/shape_{number}'
        place = {
            'position': shape.position,
            'wxyz': _wxyz(_turn(shape.turn)),
            'opacity': self._opacity,
        }
        color = tuple(round(255 * part) for part in shape.color)
        if len(shape.size) == 3:
            handle = self._scene.add_box(name, color, shape.size, **place)
        else:
            handle = self._scene.add_cylinder(name, *shape.size, color, **place)
        if shape.link == BODY:
            self._torso.append(handle)

    def _add_marks(self) -> None:
        scene, at = self._scene, self._at
        colors = np.array([LEFT, LEFT, RIGHT, RIGHT], dtype=np.uint8)
        thin = {'shaft_radius': 0.0025, 'head_radius': 0.006, 'head_length': 0.014}
        self._arrows = scene.add_arrows(f'{at}/forces', np.zeros((4, 2, 3)), colors, **thin)
        self._center = scene.add_icosphere(f'{at}/center_of_mass', 0.008, CENTER)
        self._below = scene.add_icosphere(f'{at}/below', 0.005, CENTER)
        line = {'thickness': 2.0, 'thickness_units': 'screen'}
        self._plumb = scene.add_line_segments(
            f'{at}/plumb', np.zeros((1, 2, 3)), np.array(CENTER, np.uint8), **line
        )
        self._support = scene.add_line_segments(
            f'{at}/support', np.zeros((CORNERS, 2, 3)), np.array(SUPPORT, np.uint8), **line
        )
        self._path = scene.add_line_segments(
            f'{at}/path', np.zeros((1, 2, 3)), np.array(PATH, np.uint8), **line
        )
        self._marks = (
            self._arrows,
            self._center,
            self._below,
            self._plumb,
            self._support,
            self._path,
        )
        self._push = scene.add_arrows(
            f'{at}/push', np.zeros((1, 2, 3)), np.array(PUSH, np.uint8), visible=False, **thin
        )
        self._push_label = scene.add_label(f'{at}/push_size', '', visible=False)


def outline(corners: Array) -> NDArray[np.float32]:
    """Return the sides of a polygon, always as many: those it lacks are points; (8, 2, 3)."""
    if not len(corners):
        return np.zeros((CORNERS, 2, 3), dtype=np.float32)
    raised = np.add(corners, (0.0, 0.0, 0.0015))
    around = raised[np.minimum(np.arange(CORNERS + 1), len(raised)) % len(raised)]
    return np.stack([around[:-1], around[1:]], axis=1).astype(np.float32)


def _wxyz(of: Any) -> tuple[float, float, float, float]:
    """Return a quaternion x y z w as viser has it."""
    x, y, z, w = of
    return w, x, y, z


def _turn(angles: tuple[float, ...]) -> Any:
    """Return the quaternion of roll, pitch and yaw, rad, about fixed axes in this order."""
    from khr_common.rotation import matrix

    total = np.eye(3)
    for axis, angle in zip(np.eye(3), angles, strict=True):
        total = matrix(rotated(angle * axis)) @ total
    return quaternion(total)
