"""What another local user tries on a run: each of its services, parameters and topics.

python -m tests.reliability.strangers.other_user ACT, of
services | topics | look | TOPIC
prints a mapping as JSON; with the name of a topic it publishes there until it is killed, and as
long it looks on
"""

import json
import os
import pwd
import sys
import time

import rclpy
from rcl_interfaces.srv import (
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter, parameter_value_to_python
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool

from khr_bringup.node_registry import registry
from khr_common.interfaces import DIAGNOSTICS, JOINT_REFERENCE
from khr_common.nodes.messages import message_class
from khr_common.nodes.node import DATA
from tests.reliability.strangers.traffic import publisher, read, send, shared, topics
from tests.support.runs import call

SECONDS = 60.0  # of wall time, for an answer
REFUSED = f'{JOINT_REFERENCE.name}: refused'
SERVICES = (GetParameters, ListParameters, SetBool, SetParameters, SetParametersAtomically)


def become_nobody():
    """Load all that the other user cannot read, then be that user."""
    for topic in topics().values():
        message_class(topic.kind)
    rclpy.init(args=['--ros-args', '--disable-external-lib-logs'], domain_id=0)
    node = rclpy.create_node('loading')
    for kind in SERVICES:
        node.create_client(kind, kind.__name__)
    for topic in topics().values():
        node.create_publisher(message_class(topic.kind), f'/loading/{topic.name.lstrip("/")}', 1)
    rclpy.spin_once(node, timeout_sec=0.0)
    rclpy.shutdown()
    nobody = pwd.getpwnam('nobody')
    os.setgroups([])
    os.setgid(nobody.pw_gid)
    os.setuid(nobody.pw_uid)


def wait(node, condition):
    """Return whether something comes true while the node listens."""
    end = time.monotonic() + SECONDS
    while not condition() and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
    return bool(condition())


def services(node, _):
    """Try every parameter of every node, then the services that steer the run."""
    assert wait(node, lambda: 'recorder' in node.get_node_names())

    def ask(kind, name, **fields):
        return call(node, kind, name, kind.Request(**fields))

    def changed(service, **values):
        parameters = [
            Parameter(key, value=each).to_parameter_msg() for key, each in values.items()
        ]
        result = ask(SetParametersAtomically, service, parameters=parameters).result
        return [result.successful, result.reason]

    found = {}
    for name in set(node.get_node_names()) & set(registry()):
        names = ask(ListParameters, f'{name}/list_parameters').result.names
        values = ask(GetParameters, f'{name}/get_parameters', names=names).values
        same = [
            Parameter(key, value=parameter_value_to_python(value)).to_parameter_msg()
            for key, value in zip(names, values, strict=True)
        ]
        results = ask(SetParameters, f'{name}/set_parameters', parameters=same).results
        for key, result in zip(names, results, strict=True):
            found[f'{name}.{key}'] = [result.successful, result.reason]
    return {
        'same': found,
        'gain': changed('ankle_controller/set_parameters_atomically', gain=3.5),
        'pause': ask(SetBool, 'simulator/pause', data=True).message,
        'resume': ask(SetBool, 'simulator/pause', data=False).message,
        'no scenario': changed('khr/switch', scenario='/etc/passwd', name='/etc/passwd'),
    }


def all_topics(node, readable):
    """Read the clock, send all that is to be refused where many may send, and be named."""
    clocks, told = [], []
    node.create_subscription(Clock, '/clock', clocks.append, 10)
    node.create_subscription(message_class(DIAGNOSTICS.kind), DIAGNOSTICS.name, told.append, 10)
    found = {'clock': wait(node, lambda: clocks)}
    for name in readable:
        sender = publisher(node, topics()[name])
        send(sender, topics()[name])
        found[name] = sender.get_subscription_count() > 0

    def named():
        words = [f'{each.name}: {each.message}' for message in told for each in message.status]
        return any(REFUSED in each and 'intruder' in each for each in words)

    return found | {'named': wait(node, named)}


def publish(node, name):
    """Publish on one topic for ever; answers to the clock with the identity of the run."""
    topic = topics()[name]
    sender = publisher(node, topic)
    while topic != JOINT_REFERENCE:
        sender.publish(message_class(topic.kind)())
        rclpy.spin_once(node, timeout_sec=0.1)

    def forge(message):
        if 0.5 not in message.position:
            message.position = [0.5] * len(message.position)
            sender.publish(message)

    node.create_subscription(JointState, name, forge, DATA)
    rclpy.spin(node)


def main(act):
    readable = [name for name in read('stand_0deg') if shared(topics()[name])]
    become_nobody()
    rclpy.init(args=['--ros-args', '--disable-external-lib-logs'])
    node = rclpy.create_node('intruder')
    if act == 'look':
        rclpy.spin(node)
    elif act in topics():
        publish(node, act)
    found = {'services': services, 'topics': all_topics}[act](node, readable)
    json.dump({'user': os.getuid(), **found}, sys.stdout)


if __name__ == '__main__':
    main(*sys.argv[1:])
