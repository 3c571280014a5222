"""Interface of the physics engines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from khr_common.rotation import Array, Vector
from khr_sim.physics.camera import Camera, Picture
from khr_sim.physics.contact import ContactForces, Pose
from khr_sim.servo import Servos, Tables


class Motion(NamedTuple):
    """Pose and twist of base_link in odom: m, quaternion x y z w, m/s, rad/s."""

    position: Vector
    orientation: Sequence[float]
    linear_velocity: Vector
    angular_velocity: Vector


class View(Protocol):
    """One robot of a scene."""

    links: Mapping[str, int]  # index in the engine of each link with mass, by name

    def place(self, position: Array, rotation: Array, posture: Sequence[float]) -> None:
        """Place the robot at rest.

        Args:
            position: of base_link in odom, m, (3,).
            rotation: of base_link in odom, (3, 3).
            posture: 17 joint angles in rad.
        """

    def push(self, link: int, force: Array, point: Array) -> None:
        """Apply a force in N at a point in m, both (3,) in odom, during the next step only."""

    def base(self) -> Motion:
        """Return the motion of base_link."""

    def joints(self) -> tuple[Array, Array]:
        """Return the joint angles in rad and the joint speeds in rad/s, both (17,)."""

    def poses(self, links: Sequence[int]) -> list[Pose]:
        """Return the poses of links other than the torso."""


class Scene(Protocol):
    """Robots on one plane through the origin of odom."""

    @property
    def bodies(self) -> Sequence[View]:
        """Return each robot, after the last ``reset``."""

    def reset(self, inclination: float) -> None:
        """Restart on ground inclined by an angle in rad."""

    def tilt_ground(self, inclination: float) -> None:
        """Incline the ground about the origin by an angle in rad."""

    def close(self) -> None:
        """Release the resources of the engine."""


class Painter(Scene, Protocol):
    """A scene that can be rendered."""

    def picture(self, camera: Camera) -> Picture:
        """Render the image of a camera."""


class Driven(Protocol):
    """Servos and contact forces of one robot."""

    servos: Servos
    forces: ContactForces


class Engine(Scene, Protocol):
    """A scene with physics.

    The feet collide with the ground by spheres, torso and arms by boxes; there are no
    self-collisions. Robots collide with one another by boxes of all links. Only the servos damp
    or brake the joints. After ``reset`` and ``place`` the same steps give equal results bit for
    bit.
    """

    def set_friction(self, coefficient: float) -> None:
        """Set the friction coefficient between robots and ground."""

    def run(self, commands: Array, tables: Tables, robots: Sequence[Driven]) -> None:
        """Advance one step per row of ``commands``.

        Args:
            commands: angles commanded by the boards in each step, rad, (steps, 17 n),
                one robot after the other.
            tables: of servos and contact forces of all robots; each robot has a part.
            robots: their servos compute torques from commands and joint states, and their forces
                accumulate those of the ground after each step.
        """
