"""Conversion of messages on the topic ``push``."""

from __future__ import annotations

from geometry_msgs.msg import WrenchStamped

from khr_common.interfaces import WORLD
from khr_common.nodes.messages import to_nanoseconds
from khr_sim.physics.push import Push
from khr_sim.run_parameters import RunParameters


def read_push(
    message: WrenchStamped, parameters: RunParameters, now_ns: int, robot: str = ''
) -> Push:
    """Convert a message to a push; a push in the past starts now.

    Args:
        message: with the force in the frame of the world or of a link, which it then acts on.
        parameters: give the link for a force in the world frame, the point and the duration.
        now_ns: time of the latest sample, ns.
        robot: that is pushed; its name may be before the link.
    """
    p, force = parameters, message.wrench.force
    frame = message.header.frame_id.removeprefix(f'{robot}/') or WORLD
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
