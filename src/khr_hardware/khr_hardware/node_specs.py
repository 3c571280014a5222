"""The specification of the board node for the graph."""

from __future__ import annotations

from khr_common.block import NodeSpec
from khr_common.interfaces import (
    BOARD_CORRECTION,
    CLOCK,
    DIAGNOSTICS,
    FOOT_FORCES,
    GYRO,
    JOINT_REFERENCE,
    JOINT_STATES,
    ROBOT_DESCRIPTION,
    STATE,
    Topic,
)
from khr_hardware.joint_map import JointMap
from khr_hardware.parameters import BoardParameters


def published_topics(parameters: BoardParameters) -> tuple[Topic, ...]:
    """Return the topics that the node publishes with the sensors of its map."""
    joint_map = JointMap.load(parameters.map)
    lacking = {
        *(() if joint_map.gyro else (GYRO,)),
        *(() if joint_map.forces else FOOT_FORCES),
        *(() if parameters.mixing == 'board' else (BOARD_CORRECTION,)),
        *(() if parameters.urdf else (ROBOT_DESCRIPTION,)),
    }
    return tuple(topic for topic in BOARD.publishes if topic not in lacking)


BOARD = NodeSpec(
    'board',
    'khr_hardware',
    BoardParameters,
    subscribes=(JOINT_REFERENCE,),
    publishes=(
        CLOCK,
        JOINT_STATES,
        GYRO,
        *FOOT_FORCES,
        BOARD_CORRECTION,
        ROBOT_DESCRIPTION,
        STATE,
        DIAGNOSTICS,
    ),
    node='khr_hardware.nodes.board:BoardNode',
    drives=True,
    brings=published_topics,
)
