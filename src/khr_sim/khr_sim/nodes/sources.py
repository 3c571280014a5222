"""The nodes that answer a sample, by name: ``gait`` of one robot, ``red/gait`` of several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from khr_common.interfaces import DECIDED, JOINT_REFERENCE, JOINTS, Topic, correction
from khr_common.nodes.joint_answer import JointAnswer
from khr_sim.plant import mix
from khr_sim.run_parameters import GAIT, REFEREE

AT_REST = (0.0,) * len(JOINTS)  # joint angles of a robot in a run without a gait, rad


def full_name(robot: str, node: str) -> str:
    """Return the name of a node with that of its robot, which is empty for one robot alone."""
    return f'{robot}/{node}' if robot else node


def is_gait(source: str) -> bool:
    """Return whether a source is the gait of a robot."""
    return source.rpartition('/')[2] == GAIT


def topic_of(source: str) -> Topic:
    """Return the topic of the answers of a source."""
    robot, _, node = source.rpartition('/')
    known = {GAIT: JOINT_REFERENCE, REFEREE: DECIDED}
    return (known.get(node) or correction(node, ())).under(robot)


def postures_of(
    robots: Sequence[str], answers: Mapping[str, JointAnswer]
) -> list[Sequence[float]]:
    """Return the reference of each robot, 17 joint angles in rad; at rest without a gait."""
    return [
        answers[gait].position if gait in answers else AT_REST
        for gait in (full_name(robot, GAIT) for robot in robots)
    ]


def targets_of(
    robots: Sequence[str], sources: Sequence[str], answers: Mapping[str, JointAnswer]
) -> list[list[float]]:
    """Return the target of each robot: its reference and corrections, in the order of the sources.

    Raises:
        KhrError: if a correction names a joint that the robot does not have.
    """
    return [
        mix(
            reference,
            [
                dict(zip(answers[source].name, answers[source].position, strict=True))
                for source in sources
                if source in answers
                and source.rpartition('/')[0] == robot
                and source.rpartition('/')[2] not in (GAIT, REFEREE)
            ],
        )
        for robot, reference in zip(robots, postures_of(robots, answers), strict=True)
    ]
