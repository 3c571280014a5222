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
from contextlib import suppress

import rclpy
from rcl_interfaces.srv import (
    GetParameters,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy._rclpy_pybind11 import RCLError
from rclpy.parameter import Parameter, parameter_value_to_python
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_srvs.srv import SetBool

from khr_bringup.node_registry import registry
from khr_common.interfaces import DIAGNOSTICS, JOINT_REFERENCE
from khr_common.nodes.messages import message_class
from khr_common.nodes.node import DATA, LATCHED
from tests.reliability.strangers.traffic import messages, read, shared, topics

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


class Intruder:
    """A node of the other user in the domain of the run."""

    def __init__(self, readable):
        rclpy.init(args=['--ros-args', '--disable-external-lib-logs'])
        self.node, self.readable = rclpy.create_node('intruder'), readable

    def call(self, kind, name, **fields):
        client = self.node.create_client(kind, name)
        assert client.wait_for_service(SECONDS), name
        future = client.call_async(kind.Request(**fields))
        rclpy.spin_until_future_complete(self.node, future, timeout_sec=SECONDS)
        assert future.done(), name
        self.node.destroy_client(client)
        return future.result()

    def set(self, service, **values):
        """Return whether parameters were taken, and why not."""
        parameters = [
            Parameter(key, value=each).to_parameter_msg() for key, each in values.items()
        ]
        result = self.call(SetParametersAtomically, service, parameters=parameters).result
        return [result.successful, result.reason]

    def wait(self, condition):
        end = time.monotonic() + SECONDS
        while not condition() and time.monotonic() < end:
            rclpy.spin_once(self.node, timeout_sec=0.1)
        return bool(condition())

    def publisher(self, topic):
        qos = LATCHED if topic.flow == 'latched' else DATA
        made = self.node.create_publisher(message_class(topic.kind), topic.name, qos)
        self.wait(made.get_subscription_count)
        return made

    def services(self):
        """Try every parameter of every node, then the services that steer the run."""
        assert self.wait(lambda: 'recorder' in self.node.get_node_names())
        found = {}
        for name in set(self.node.get_node_names()) & set(registry()):
            names = self.call(ListParameters, f'{name}/list_parameters').result.names
            values = self.call(GetParameters, f'{name}/get_parameters', names=names).values
            same = [Parameter(key, value=parameter_value_to_python(value)).to_parameter_msg()
                    for key, value in zip(names, values, strict=True)]  # fmt: skip
            results = self.call(SetParameters, f'{name}/set_parameters', parameters=same).results
            for key, result in zip(names, results, strict=True):
                found[f'{name}.{key}'] = [result.successful, result.reason]
        return {
            'same': found,
            'gain': self.set('ankle_controller/set_parameters_atomically', gain=3.5),
            'pause': self.call(SetBool, 'simulator/pause', data=True).message,
            'resume': self.call(SetBool, 'simulator/pause', data=False).message,
            'no scenario': self.set('khr/switch', scenario='/etc/passwd', name='/etc/passwd'),
        }

    def topics(self):
        """Read the clock, send all that is to be refused where many may send, and be named."""
        clocks, told = [], []
        self.node.create_subscription(Clock, '/clock', clocks.append, 10)
        kind = message_class(DIAGNOSTICS.kind)
        self.node.create_subscription(kind, DIAGNOSTICS.name, told.append, 10)
        found = {'clock': self.wait(lambda: clocks)}
        for name in self.readable:
            sender = self.publisher(topics()[name])
            for message in messages(topics()[name]):
                with suppress(RCLError):  # as far as the middleware takes it
                    sender.publish(message)
            found[name] = sender.get_subscription_count() > 0

        def named():
            words = [status.message for message in told for status in message.status]
            return any(each.startswith(REFUSED) and 'intruder' in each for each in words)

        return found | {'named': self.wait(named)}

    def publish(self, name):
        """Publish on one topic for ever; answers to the clock with the identity of the run."""
        topic = topics()[name]
        sender = self.publisher(topic)
        if topic != JOINT_REFERENCE:
            while True:
                sender.publish(message_class(topic.kind)())
                rclpy.spin_once(self.node, timeout_sec=0.1)

        def forge(message):
            if 0.5 not in message.position:
                message.position = [0.5] * len(message.position)
                sender.publish(message)

        self.node.create_subscription(JointState, name, forge, DATA)
        rclpy.spin(self.node)


def main(act, *words):
    readable = [name for name in read('stand_0deg') if shared(topics()[name])]
    become_nobody()
    intruder = Intruder(readable)
    if act == 'look':
        rclpy.spin(intruder.node)
    acts = {'services': intruder.services, 'topics': intruder.topics}
    found = acts[act](*words) if act in acts else intruder.publish(act)
    json.dump({'user': os.getuid(), **found}, sys.stdout)


if __name__ == '__main__':
    main(*sys.argv[1:])
