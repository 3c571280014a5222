"""The nodes that answer a sample, by name: ``gait`` of one robot, ``red/gait`` of several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from khr_common.interfaces import DECIDED, JOINT_REFERENCE, JOINTS, Topic, correction, full_name
from khr_common.nodes.messages import JointAnswer
from khr_sim.plant import mix
from khr_sim.run_parameters import GAIT, REFEREE

AT_REST = (0.0,) * len(JOINTS)  # joint angles of a robot in a run without a gait, rad
Answers = Mapping[str, JointAnswer]  # by source


class Sources:
    """The sources of a run: of each robot a gait and nodes with corrections; of a bout a referee.

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
