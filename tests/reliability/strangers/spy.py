"""What another machine can do to a run: see its nodes, receive its clock, change a gain.

python -m tests.reliability.strangers.spy; prints a mapping as JSON
"""

import json
import sys
import time

import rclpy
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rosgraph_msgs.msg import Clock

SECONDS = 5.0  # of wall time: many times what discovery takes


def main():
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
    main()
