"""Messages that no node of a run has sent: not readable, of another run, out of all bounds."""

import struct
from contextlib import suppress

from rclpy._rclpy_pybind11 import RCLError

from khr_bringup.node_registry import registry
from khr_bringup.scenario import scenario as scenarios
from khr_common.interfaces import (
    DECIDED,
    JOINT_STATE,
    PUSH,
    READY,
    TF,
    TF_AVAILABLE,
    TF_STATIC,
    Topic,
)
from khr_common.nodes.messages import message_class, serialized
from khr_common.nodes.node import DATA, LATCHED
from tests.support.runs import wait_for

# Of an empty message nothing comes: the middleware drops it, and then keeps back for half a minute
# what the same sender sends. So it has a name of its own.
EMPTY = b''
GARBAGE = (
    b'\0\1\0\0',
    b'\0\0\0\0',
    b'\0\1\0\0' + bytes(3),
    b'\0\1\0\0' + b'\xff' * 64,
    b'\0\1\0\0' + bytes(8) + b'\xff' * 4 + b'x',  # a text longer than the message
    b'\0\0\0\0' + b'\xff' * 64,
    b'not CDR at all',
    b'\0\1\0\0' + bytes(8) + struct.pack('<I', 3) + b'\xff\xfe\0' + bytes(60),  # no UTF-8
)
TEXTS = ('garbage', '', 'monitor', 'monitor x -', 'monitor 9 9 9', 'recorder 5 of_another_run')


def topics() -> dict[str, Topic]:
    """Return all topics of the graph by name."""
    found = {
        t.name: t for n in registry().values() for t in (*n.spec.publishes, *n.spec.subscribes)
    }
    if not TF_AVAILABLE:
        found = {name: t for name, t in found.items() if t not in (TF, TF_STATIC)}
    return found | {PUSH.name: PUSH}


def read(scenario: str) -> set[str]:
    """Return the names of the topics that somebody reads in a scenario; it has no referee."""
    nodes = [registry()[name].spec for name in scenarios.load_scenario(scenario).nodes]
    found = {topic.name for spec in nodes for topic in spec.subscribes} | {PUSH.name}
    return found - {DECIDED.name}


def shared(topic: Topic) -> bool:
    """Return whether a second source of a topic does not end the run."""
    return topic.of_run or topic.name in (READY.name, PUSH.name, '/diagnostics')


def messages(topic: Topic) -> list[bytes]:
    """Return what is to be refused on a topic."""
    kind = message_class(topic.kind)
    found = [*GARBAGE, serialized(kind())]
    if topic.kind == 'std_msgs/msg/String':
        found += [serialized(kind(data=text)) for text in TEXTS]
    if topic.kind == JOINT_STATE:
        for number in (float('nan'), 1e308):
            names = list(topic.names) or ['l_ankle_pitch', 'r_ankle_pitch']
            found.append(serialized(kind(name=names, position=[number] * len(names))))
        found.append(serialized(kind(name=['no_such_joint'], position=[0.0])))
        found.append(serialized(kind(name=['head_yaw'] * 3, position=[0.0])))
    if topic.name == PUSH.name:
        for frame, force in (('odom', 1e308), ('odom', float('nan')), ('no_such_link', 1.0)):
            push = kind()
            push.header.frame_id, push.wrench.force.x = frame, force
            found.append(serialized(push))
    return found


def publisher(node, topic: Topic):
    """Create a publisher on a topic of the run that a node has joined, and wait for a reader."""
    qos = LATCHED if topic.flow == 'latched' else DATA
    made = node.create_publisher(message_class(topic.kind), topic.name, qos)
    wait_for(made.get_subscription_count, f'a reader of {topic.name}')
    return made


def send(sender, topic: Topic) -> None:
    """Send all that is to be refused on a topic, as far as the middleware takes it."""
    for message in messages(topic):
        with suppress(RCLError):
            sender.publish(message)
