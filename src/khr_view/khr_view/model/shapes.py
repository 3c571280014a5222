"""The look of the robot: the visuals of its URDF."""

from __future__ import annotations

from dataclasses import dataclass
from xml.etree import ElementTree

from khr_description.robot import Robot

Vector = tuple[float, ...]
GREY = (0.6, 0.6, 0.6)


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
