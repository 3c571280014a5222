"""Interface of the physics engines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from khr_common.maths.rotation import Array, Vector
from khr_sim.physics.camera import Camera, Picture
from khr_sim.physics.contact import ContactForces, Pose
from khr_sim.servo import Servos


class Motion(NamedTuple):
    """Pose and twist of base_link in odom: m, quaternion x y z w, m/s, rad/s."""

    position: Vector
    orientation: Sequence[float]
    linear_velocity: Vector
    angular_velocity: Vector


class Scene(Protocol):
    """One robot on one plane through the origin of odom."""

    def reset(self, inclination: float) -> None:
        """Restart on ground inclined by an angle in rad."""

    def place(self, position: Array, rotation: Array, posture: Sequence[float]) -> None:
        """Place the robot at rest.

        Args:
            position: of base_link in odom, m, (3,).
            rotation: of base_link in odom, (3, 3).
            posture: 17 joint angles in rad.
        """

    def tilt_ground(self, inclination: float) -> None:
        """Incline the ground about the origin by an angle in rad."""

    def close(self) -> None:
        """Release the resources of the engine."""


class Painter(Scene, Protocol):
    """A scene that can be rendered."""

    def picture(self, camera: Camera) -> Picture:
        """Render the image of a camera."""


class Engine(Scene, Protocol):
    """A scene with physics.

    The feet collide with the ground by spheres, torso and arms by boxes; there are no
    self-collisions. Only the servos damp or brake the joints. After ``reset`` and ``place`` the
    same steps give equal results bit for bit.
    """

    links: Mapping[str, int]  # index in the engine of each link with mass, by name

    def set_friction(self, coefficient: float) -> None:
        """Set the friction coefficient between robot and ground."""

    def push(self, link: int, force: Array, point: Array) -> None:
        """Apply a force in N at a point in m, both (3,) in odom, during the next step only."""

    def run(self, commands: Array, servos: Servos, forces: ContactForces) -> Sequence[float]:
        """Advance one step per row of ``commands``; return the last torques of the servos.

        Args:
            commands: angles commanded by the board in each step, rad, (steps, 17).
            servos: compute torques from commands and joint states.
            forces: accumulates the contact forces of robot and ground after each step.
        """

    def base(self) -> Motion:
        """Return the motion of base_link."""

    def joints(self) -> tuple[Array, Array]:
        """Return the joint angles in rad and the joint speeds in rad/s, both (17,)."""

    def poses(self, links: Sequence[int]) -> list[Pose]:
        """Return the poses of links other than the torso."""
