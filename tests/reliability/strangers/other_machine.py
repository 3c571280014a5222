"""Another machine: a network namespace with memory of its own, joined by a virtual cable.

Run as a program there, it prints what a stranger sees of a run, as JSON.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from contextlib import contextmanager

import rclpy
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rosgraph_msgs.msg import Clock

from tests import ROOT

HERE, THERE = '10.213.77.1', '10.213.77.2'
SECONDS = 5.0  # of wall time: many times what discovery takes


def why_not():
    """Return why there can be no other machine here; empty if there can."""
    if os.geteuid() != 0:
        return 'only root can make a network namespace'
    missing = [tool for tool in ('ip', 'unshare') if shutil.which(tool) is None]
    if missing:
        return f'{missing[0]} is missing'
    name = f'khr-try-{os.getpid()}'
    tried = subprocess.run(['ip', 'netns', 'add', name], capture_output=True, check=False)
    subprocess.run(['ip', 'netns', 'del', name], capture_output=True, check=False)
    return '' if tried.returncode == 0 else 'this system gives no network namespaces'


@contextmanager
def other_machine():
    """Yield the name of a network namespace that reaches this one; it is removed again."""
    name, cable = f'khr-{os.getpid()}', f'k{os.getpid()}'

    def ip(*words):
        subprocess.run(['ip', *words], check=True, capture_output=True)

    ip('netns', 'add', name)
    try:
        ip('link', 'add', cable, 'type', 'veth', 'peer', 'name', f'{cable}b', 'netns', name)
        for where, address, device in (
            ((), HERE, cable),
            (('-n', name), THERE, f'{cable}b'),
            (('-n', name), '127.0.0.1', 'lo'),
        ):
            if device != 'lo':
                ip(*where, 'addr', 'add', f'{address}/24', 'dev', device)
            ip(*where, 'link', 'set', device, 'up')
        yield name
    finally:
        subprocess.run(['ip', 'link', 'del', cable], check=False, capture_output=True)
        subprocess.run(['ip', 'netns', 'del', name], check=False, capture_output=True)


def spied(machine, domain):
    """Return what a stranger on another machine sees of a domain, and whether it changed a gain."""
    plain = {k: v for k, v in os.environ.items() if not k.startswith(('ROS_', 'FAST', 'RMW_'))}
    ended = subprocess.run(
        ['ip', 'netns', 'exec', machine, 'unshare', '--mount', 'sh', '-c',
         f'mount -t tmpfs none /dev/shm && exec {sys.executable} -m tests.reliability.strangers.other_machine'],
        env={**plain, 'ROS_DOMAIN_ID': str(domain), 'ROS_STATIC_PEERS': HERE},
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    return json.loads(ended.stdout)


def spy():
    """See the nodes of a run, receive its clock, change a gain."""
    rclpy.init(args=['--ros-args', '--disable-external-lib-logs'])
    node = rclpy.create_node('spy')
    clocks = []
    node.create_subscription(Clock, '/clock', clocks.append, 10)
    client = AsyncParameterClient(node, 'ankle_controller')
    end, future = time.monotonic() + SECONDS, None
    while time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)
        if future is None and client.services_are_ready():
            future = client.set_parameters([Parameter('gain', value=18.0)])
    changed = bool(future and future.done() and future.result().results[0].successful)
    seen = [name for name in node.get_node_names() if name != 'spy']
    json.dump({'nodes': seen, 'clocks': len(clocks), 'changed': changed}, sys.stdout)


if __name__ == '__main__':
    spy()
