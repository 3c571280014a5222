"""What comes to the simulator over topics: answers of other nodes, and pushes."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from geometry_msgs.msg import WrenchStamped

from khr_common import cdr
from khr_common.interfaces import WORLD
from khr_common.nodes.messages import to_nanoseconds
from khr_common.run_identity import MalformedError
from khr_sim.physics.push import Push
from khr_sim.run_parameters import RunParameters


class Answer(NamedTuple):
    """What a node wants of the joints, rad, for the instant of its stamp."""

    stamp_ns: int
    name: list[str]
    position: tuple[float, ...]


def read_answer(data: bytes) -> Answer:
    """Read an answer from the bytes of its message.

    Raises:
        MalformedError: if it is none.
    """
    names, positions = cdr.joint_positions(data)
    if len(names) != len(positions) or not isfinite(sum(positions)):
        raise MalformedError('not one finite position per joint')
    return Answer(cdr.clock(data), names, positions)


def read_push(message: WrenchStamped, parameters: RunParameters, now_ns: int) -> Push:
    """Return the push that a message asks for; what is past begins now.

    Args:
        message: in the frame of the world, or in that of the link it acts on.
        parameters: the link of the former, and point and duration of both.
        now_ns: the instant, ns.

    Raises:
        SimError: if it is not accepted.
    """
    p, force = parameters, message.wrench.force
    frame = message.header.frame_id or WORLD
    x, y, z = p.push_point
    push = Push(
        start=max(to_nanoseconds(message.header.stamp), now_ns) / 1e9,
        duration=p.push_duration,
        frame=frame,
        link=p.push_link if frame == WORLD else frame,
        force=(force.x, force.y, force.z),
        point=(x, y, z),
    )
    p.check_push(push)
    return push
