"""What the world asks of a physics engine, in terms that every engine shares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from khr_common.maths.rotation import Array, Vector
from khr_sim.physics.camera import Camera, Picture
from khr_sim.physics.contact import ContactForces, Pose
from khr_sim.servo import Servos


class Motion(NamedTuple):
    """Where base_link is and how it moves, in odom: m, quaternion x y z w, m/s, rad/s."""

    position: Vector
    orientation: Sequence[float]
    linear_velocity: Vector
    angular_velocity: Vector


class Scene(Protocol):
    """One robot on one plane through the origin of odom."""

    def reset(self, inclination: float) -> None:
        """Start anew, with a ground inclined by so many rad."""

    def place(self, position: Array, rotation: Array, posture: Sequence[float]) -> None:
        """Put the robot somewhere, at rest.

        Args:
            position: of base_link in odom, m, (3,).
            rotation: of base_link in odom, (3, 3).
            posture: 17 joint angles in rad.
        """

    def tilt_ground(self, inclination: float) -> None:
        """Incline the ground by so many rad about the origin."""

    def close(self) -> None:
        """Release what the engine holds."""


class Painter(Scene, Protocol):
    """A scene to look at."""

    def picture(self, camera: Camera) -> Picture:
        """Draw what a camera sees."""


class Engine(Scene, Protocol):
    """A scene in which physics goes on.

    The feet touch the ground by the spheres of the description, torso and arms by their boxes;
    the robot's parts pass through one another. Nothing damps or brakes its joints but the servos.
    After a reset and a placing the same steps give the same bits.

    Attributes:
        links: the engine's number of each link that has mass, by name.
    """

    links: Mapping[str, int]

    def set_friction(self, coefficient: float) -> None:
        """Set the friction coefficient between robot and ground."""

    def push(self, link: int, force: Array, point: Array) -> None:
        """Apply a force during the next step alone: N, at a point in m, both (3,) in odom."""

    def run(self, commands: Array, servos: Servos, forces: ContactForces) -> Sequence[float]:
        """Advance one step per row of ``commands``; return the last torques of the servos.

        Args:
            commands: angles commanded by the board in each step, rad, (steps, 17).
            servos: turn commands and joint states into torques.
            forces: take the contacts of the robot with the ground after each step.
        """

    def base(self) -> Motion:
        """Return the motion of base_link."""

    def joints(self) -> tuple[Array, Array]:
        """Return the joint angles in rad and the joint speeds in rad/s, both (17,)."""

    def poses(self, links: Sequence[int]) -> list[Pose]:
        """Return the poses of links other than the torso."""
