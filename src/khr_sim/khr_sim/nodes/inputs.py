"""What the simulator receives: answers to a sample, and messages on the topic ``push``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from geometry_msgs.msg import WrenchStamped

from khr_common.errors import KhrError
from khr_common.interfaces import (
    DECIDED,
    JOINT_REFERENCE,
    JOINTS,
    WORLD,
    Topic,
    correction,
    full_name,
    mix,
)
from khr_common.nodes.messages import JointAnswer, to_nanoseconds
from khr_common.stamps import SYSTEM_TIME
from khr_sim.physics.push import Push
from khr_sim.run_parameters import GAIT, REFEREE, RunParameters

AT_REST = (0.0,) * len(JOINTS)  # joint angles of a robot in a run without a gait, rad
Answers = Mapping[str, JointAnswer]  # by source


class Sources:
    """The sources of a run: of each robot a gait and nodes with corrections; of a bout a referee.

    One robot alone has ``gait``, several have ``red/gait``.

    Args:
        robots: names; an empty one of one robot alone.
        names: of the nodes that answer.

    Attributes:
        names: of the nodes that answer.
        gaits: those of them that are gaits.
        topics: of their answers, by name.
    """

    def __init__(self, robots: Sequence[str], names: Sequence[str]) -> None:
        self.names = tuple(name for name in names if name)
        own = {robot: full_name(robot, GAIT) for robot in robots}
        self.gaits = frozenset(own.values()) & frozenset(self.names)
        self.topics = {name: _topic_of(name) for name in self.names}
        corrections = [name for name in self.names if name not in (*self.gaits, REFEREE)]
        self._of_robots = [  # gait and corrections
            (gait, [name for name in corrections if name.rpartition('/')[0] == robot])
            for robot, gait in own.items()
        ]

    def decided(self, answers: Answers) -> bool:
        """Return whether the referee has decided the round."""
        return REFEREE in answers and bool(answers[REFEREE].position[0])

    def references(self, answers: Answers) -> list[Sequence[float]]:
        """Return the reference of each robot, 17 joint angles in rad; at rest without a gait."""
        return [
            answers[gait].position if gait in answers else AT_REST for gait, _ in self._of_robots
        ]

    def targets(self, answers: Answers) -> list[list[float]]:
        """Return the target of each robot: its reference and the corrections, in their order.

        Raises:
            KhrError: if a correction names a joint that the robot does not have.
        """
        return [
            mix(
                reference,
                [
                    dict(zip(answers[name].name, answers[name].position, strict=True))
                    for name in corrections
                    if name in answers
                ],
            )
            for reference, (_, corrections) in zip(
                self.references(answers), self._of_robots, strict=True
            )
        ]


def _topic_of(source: str) -> Topic:
    robot, _, node = source.rpartition('/')
    known = {GAIT: JOINT_REFERENCE, REFEREE: DECIDED}
    return (known.get(node) or correction(node, ())).under(robot)


def read_push(
    message: WrenchStamped, parameters: RunParameters, now_ns: int, robot: str = ''
) -> Push:
    """Convert a message to a push; a push in the past starts now.

    Args:
        message: with the force in the frame of the world or of a link, which it then acts on.
        parameters: give the link for a force in the world frame, the point and the duration.
        now_ns: time of the latest sample, ns.
        robot: that is pushed; its name may be before the link.

    Raises:
        KhrError: if the push is not accepted, or its timestamp is system time.
    """
    p, force = parameters, message.wrench.force
    frame = message.header.frame_id.removeprefix(f'{robot}/') or WORLD
    x, y, z = p.push_point
    stamp_ns = to_nanoseconds(message.header.stamp)
    if stamp_ns > SYSTEM_TIME:
        raise KhrError.refused('stamp', 'system time', 'simulated time (use_sim_time), or 0')
    push = Push(
        start=max(stamp_ns, now_ns) / 1e9,
        duration=p.push_duration,
        frame=frame,
        link=p.push_link if frame == WORLD else frame,
        force=(force.x, force.y, force.z),
        point=(x, y, z),
    )
    p.check_push(push)
    return push
