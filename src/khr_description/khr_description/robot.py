"""Robot description from the URDF: links, joints, kinematics and mass properties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from math import cos, sin
from xml.etree import ElementTree

import numpy as np

from khr_common.errors import KhrError, named, quoted
from khr_common.interfaces import JOINTS
from khr_common.rotation import Array, applied, dot, matrix, product

__all__ = ['JOINTS', 'Joint', 'Link', 'Robot']

DESCRIPTION = files('khr_description') / 'urdf' / 'khr3hv.urdf'


@dataclass(frozen=True)
class Link:
    """A link: mass in kg, centre of mass in m and inertia about it in kg m^2, in its frame."""

    name: str
    mass: float
    center_of_mass: Array
    inertia: Array


@dataclass(frozen=True)
class Joint:
    """A revolute or fixed joint: origin in m in the parent's frame; limits in rad, N m, rad/s."""

    name: str
    kind: str
    parent: str
    child: str
    origin: Array
    axis: Array
    lower: float
    upper: float
    effort: float
    velocity: float


@cache
def link_names() -> tuple[str, ...]:
    """Return the link names of the packaged description."""
    return tuple(Robot.load().links)


# Colours of the suit: that of the description, and those of robots of a bout, by name.
SUIT, SUITS = 'rgba="0.12 0.25 0.62 1"', {'red': 'rgba="0.72 0.12 0.10 1"'}


def dressed(urdf: str, name: str) -> str:
    """Return the description of a robot in a suit of its own, by its name in a bout."""
    if name not in SUITS:
        return urdf
    assert SUIT in urdf
    return urdf.replace(SUIT, SUITS[name])


class Robot:
    """The links and joints of a URDF, in the order of the file.

    Raises:
        KhrError: if the text is no URDF, or lacks one of the 17 joints.
    """

    def __init__(self, urdf: str) -> None:
        try:
            self.xml = ElementTree.fromstring(urdf)
        except ElementTree.ParseError as error:
            raise KhrError(f'urdf: not well-formed XML: {error}') from error
        self.urdf = urdf
        try:
            self.links = {link.name: link for link in map(_link, self.xml.iter('link'))}
            self.joints = {joint.name: joint for joint in map(_joint, self.xml.iter('joint'))}
        except KeyError as error:
            raise KhrError(f'urdf: {error.args[0]} missing; accepted: links and joints') from error
        except (ValueError, AttributeError, TypeError) as error:
            raise KhrError(f'urdf: {quoted(str(error))}; accepted: numbers') from error
        revolute = {name for name, joint in self.joints.items() if joint.kind == 'revolute'}
        if revolute != set(JOINTS):
            raise KhrError(
                f'urdf: {quoted(", ".join(sorted(revolute ^ set(JOINTS))))} missing or unknown; '
                f'accepted: the 17 joints of the KHR-3HV'
            )

    @classmethod
    def load(cls) -> Robot:
        """Read the packaged description."""
        return cls(DESCRIPTION.read_text())

    @property
    def mass(self) -> float:
        """Sum the masses of all links, in kg."""
        return sum(link.mass for link in self.links.values())

    def limits(self) -> Array:
        """Return the joint limits, in rad: shape (17, 2), lower and upper."""
        return np.array([(self.joints[name].lower, self.joints[name].upper) for name in JOINTS])

    def poses(self, posture: Sequence[float] | Array) -> dict[str, Array]:
        """Return the pose (4, 4) of every link in base_link for 17 joint angles in rad."""
        angles = dict(zip(JOINTS, posture, strict=True))
        poses = {'base_link': np.eye(4)}
        for joint in self.joints.values():
            step = np.eye(4)
            step[:3, 3] = joint.origin
            half = angles.get(joint.name, 0.0) / 2.0
            step[:3, :3] = matrix((*(sin(half) * joint.axis), cos(half)))
            poses[joint.child] = product(poses[joint.parent], step)
        return poses

    def center_of_mass(self, poses: dict[str, Array]) -> Array:
        """Return the centre of mass (3,) in base_link, in m, for the poses of the links."""
        moments = [
            link.mass * applied(poses[link.name], (*link.center_of_mass, 1.0))[:3]
            for link in self.links.values()
        ]
        return np.asarray(np.sum(moments, axis=0) / self.mass)

    def inertia(self, poses: dict[str, Array], about: Array, links: Sequence[str] = ()) -> Array:
        """Return the inertia (3, 3) about a point of base_link, in kg m^2.

        Args:
            poses: of the links in base_link.
            about: the point (3,), in m.
            links: the links to count; all of them if empty.
        """
        total = np.zeros((3, 3))
        for name in links or self.links:
            link, pose = self.links[name], poses[name]
            arm = applied(pose, (*link.center_of_mass, 1.0))[:3] - about
            total += product(product(pose[:3, :3], link.inertia), pose[:3, :3].T)
            total += link.mass * (dot(arm, arm) * np.eye(3) - np.outer(arm, arm))
        return total

    def descendants(self, link: str) -> list[str]:
        """List a link and all its descendants."""
        below = [link]
        for joint in self.joints.values():
            if joint.parent in below:
                below.append(joint.child)
        return below

    def joint_inertia(self) -> Array:
        """Return the inertia outward of each joint about its axis, zero pose, kg m^2, (17,)."""
        poses = self.poses([0.0] * len(JOINTS))
        inertias = []
        for name in JOINTS:
            joint = self.joints[name]
            total = self.inertia(poses, poses[joint.child][:3, 3], self.descendants(joint.child))
            inertias.append(dot(joint.axis, applied(total, joint.axis)))
        return np.array(inertias)


def vector(element: ElementTree.Element | None, key: str) -> Array:
    """Return the numbers of an attribute of the URDF; zeros (3,) where it is left out."""
    text = '0 0 0' if element is None else element.get(key, '0 0 0')
    return np.array([float(value) for value in text.split()])


def _link(element: ElementTree.Element) -> Link:
    inertial = element.find('inertial')
    if inertial is None:
        return Link(element.attrib['name'], 0.0, np.zeros(3), np.zeros((3, 3)))
    mass, inertia = inertial.find('mass'), inertial.find('inertia')
    if mass is None or inertia is None:
        raise KhrError(f'urdf: {named(element.get("name"))}: inertial needs mass and inertia')
    i = {key: float(value) for key, value in inertia.attrib.items()}
    return Link(
        element.attrib['name'],
        float(mass.attrib['value']),
        vector(inertial.find('origin'), 'xyz'),
        np.array(
            [
                [i['ixx'], i['ixy'], i['ixz']],
                [i['ixy'], i['iyy'], i['iyz']],
                [i['ixz'], i['iyz'], i['izz']],
            ]
        ),
    )


def _joint(element: ElementTree.Element) -> Joint:
    parent, child, limit = element.find('parent'), element.find('child'), element.find('limit')
    if parent is None or child is None:
        raise KhrError(f'urdf: {named(element.get("name"))}: joint needs parent and child')
    bound = {} if limit is None else limit.attrib
    return Joint(
        element.attrib['name'],
        element.attrib['type'],
        parent.attrib['link'],
        child.attrib['link'],
        vector(element.find('origin'), 'xyz'),
        vector(element.find('axis'), 'xyz'),
        *(float(bound.get(key, '0')) for key in ('lower', 'upper', 'effort', 'velocity')),
    )
