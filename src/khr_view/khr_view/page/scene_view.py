"""The robot and the slope in viser's scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import floor
from typing import Any
from xml.etree import ElementTree

import numpy as np
from viser.transforms import SO3

from khr_common.interfaces import BODY, JOINTS, TORSO
from khr_common.rotation import rotated
from khr_description.robot import Robot
from khr_view.model.scene import Snapshot
from khr_view.page.marks import Marks

Vector = tuple[float, ...]
GREY = (0.6, 0.6, 0.6)
DRAG, LARGEST_DRAG = 100.0, 0.3  # N per m that the torso is dragged, and m that count
OPACITY = 0.35  # of a transparent link
FOOT = '_foot'
OVERHEAD = 0.2  # m from the torso's frame up to the robot's name
# Aims a push at the torso, N in odom; it is given once the second argument is true.
Push = Callable[[tuple[float, float, float], bool], object]
STRIPE = 0.1  # m between the lines of the slope
SIZE = (2.4, 1.0)  # m, of the slope


@dataclass(frozen=True)
class Shape:
    """A box or a cylinder along z, in the frame of its link."""

    link: str  # that it belongs to
    size: Vector  # of a box along x, y and z; radius and length of a cylinder; m
    position: Vector  # of its centre, m
    turn: Vector  # roll, pitch and yaw, rad
    color: Vector  # red, green and blue, 0 to 1


def shapes(robot: Robot) -> list[Shape]:
    """Return the boxes and cylinders of a robot; other visuals of the URDF are omitted."""
    colors = {
        material.get('name'): _numbers(material.find('color'), 'rgba')[:3]
        for material in robot.xml.findall('material')
    }
    found = []
    for link in robot.xml.iter('link'):
        for visual in link.findall('visual'):
            size = _size(visual)
            if not size:
                continue
            origin, material = visual.find('origin'), visual.find('material')
            color = colors.get(material.get('name')) if material is not None else None
            found.append(
                Shape(
                    link.attrib['name'],
                    size,
                    _numbers(origin, 'xyz'),
                    _numbers(origin, 'rpy'),
                    color or GREY,
                )
            )
    return found


def _size(visual: ElementTree.Element) -> Vector:
    box, cylinder = visual.find('geometry/box'), visual.find('geometry/cylinder')
    if box is not None:
        return _numbers(box, 'size')
    if cylinder is not None:
        return float(cylinder.attrib['radius']), float(cylinder.attrib['length'])
    return ()


def _numbers(element: ElementTree.Element | None, key: str) -> Vector:
    text = '0 0 0' if element is None else element.get(key, '0 0 0')
    return tuple(float(value) for value in text.split())


class RobotView:
    """One robot, with its marks.

    Args:
        scene: viser's.
        at: name of its node of the scene.
        robot: its description.
        shift: offset of the shown from the true position, m, (3,).
        name: over its head; empty for no label.

    Attributes:
        marks: drawn with the robot.
    """

    def __init__(
        self,
        scene: Any,
        at: str,
        robot: Robot,
        shift: tuple[float, float, float] = (0.0, 0.0, 0.0),
        name: str = '',
    ) -> None:
        self._scene = scene
        self._frame = scene.add_frame(at, show_axes=False, position=shift)
        self._joints: dict[str, Any] = {}
        self._names = self._add_frames(robot, at)
        self._shapes: list[Any] = []
        self._torso: list[Any] = []  # links that can be dragged
        for number, shape in enumerate(shapes(robot)):
            self._add_shape(number, shape)
        if name:
            scene.add_label(f'{self._names[BODY]}/name', name, position=(0.0, 0.0, OVERHEAD))
        self.marks = Marks(scene, at, self._names)
        self._last: tuple[float, ...] = ()

    def show(self, scene: Snapshot) -> None:
        """Move all links to their places in a scene."""
        self._base.position = scene.base[:3]
        x, y, z, w = scene.base[3:]
        self._base.wxyz = w, x, y, z
        for index, name in enumerate(JOINTS):
            angle = scene.joints[index]
            if not self._last or angle != self._last[index]:
                frame, axis = self._joints[name]
                x, y, z, w = rotated(angle * axis)
                frame.wxyz = w, x, y, z
        self._last = scene.joints
        self.marks.show(scene)

    def tilt(self, angle: float) -> None:
        """Rotate the robot about the axis of the slope, rad, to show it on another slope."""
        self._frame.wxyz = SO3.from_y_radians(angle).wxyz

    def see_through(self, through: bool) -> None:
        """Draw the links transparent or solid."""
        for shape in self._shapes:
            shape.opacity = OPACITY if through or FOOT in shape.name else None

    def on_drag(self, push: Push) -> None:
        """Report pushes that are aimed by dragging the torso, and given at the drag's end."""

        async def dragged(event: Any) -> None:
            way = np.subtract(event.end_position, event.start_position)
            force = way * DRAG * min(1.0, LARGEST_DRAG / max(float(np.linalg.norm(way)), 1e-9))
            push(tuple(force.tolist()), event.phase == 'end')

        for handle in self._torso:
            handle.on_drag('left')(dragged)

    def _add_frames(self, robot: Robot, at: str) -> dict[str, str]:
        """Add a node for each link, beneath its parent's; return their names."""
        names = {BODY: f'{at}/{BODY}'}
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
        place: dict[str, Any] = {
            'position': shape.position,
            'wxyz': SO3.from_rpy_radians(*shape.turn).wxyz,
        }
        # The balance under the feet shows through them.
        place['opacity'] = OPACITY if shape.link.endswith(FOOT) else None
        color = tuple(round(255 * part) for part in shape.color)
        if len(shape.size) == 3:
            handle = self._scene.add_box(name, color, shape.size, **place)
        else:
            handle = self._scene.add_cylinder(name, *shape.size, color, **place)
        self._shapes.append(handle)
        if shape.link in (BODY, TORSO):  # older recordings have no torso
            self._torso.append(handle)


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
