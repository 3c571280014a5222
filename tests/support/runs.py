"""Start, watch, join, interrupt and read real runs of the real command."""

import os
import re
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil
import pytest
from coverage import Coverage
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from tests import ROOT

STORE = get_typestore(Stores.ROS2_JAZZY)
KHR = [sys.executable, '-m', 'khr.cli.command']
# Longer than any test waits, and in lockstep no faster than leaves the test some of the machine.
LONG = ('--duration', '600', '--set', 'simulator.pace=2')


@dataclass
class Finished:
    """A run of khr that has ended: its exit code, what it printed, its folder."""

    code: int
    out: str
    err: str
    folder: Path

    @property
    def hash(self):
        return self.out.strip().splitlines()[-1].removeprefix('trajectory hash ')

    def bag(self):
        return Bag(self.folder / 'bag')


class Bag(Mapping):
    """The messages of a bag by topic, each with its time in ns, deserialized when asked for."""

    def __init__(self, folder):
        self._raw = defaultdict(list)
        self._topics = {}
        with Reader(folder) as reader:
            for connection, time_ns, data in reader.messages():
                self._raw[connection.topic].append((time_ns, data, connection.msgtype))

    def __getitem__(self, topic):
        if topic not in self._topics:
            self._topics[topic] = [
                (time_ns, STORE.deserialize_cdr(data, kind))
                for time_ns, data, kind in self._raw.get(topic, [])
            ]
        return self._topics[topic]

    def __contains__(self, topic):
        return topic in self._raw

    def __iter__(self):
        return iter(self._raw)

    def __len__(self):
        return len(self._raw)


def stamp_ns(message):
    """Return the stamp of a message, ns."""
    stamp = message.clock if hasattr(message, 'clock') else message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec


def start_khr(*arguments, measured=False):
    """Start khr in the background, in a session of its own; a run leaves out its picture.

    With ``measured`` its processes take part in the measurement of coverage, if there is one:
    they run at half the speed.
    """
    measuring = measured and Coverage.current() is not None
    if arguments[0] == 'run' and '--draw' not in arguments:
        arguments += ('--no-draw',)  # Matplotlib takes a third of a short run's computing
    return subprocess.Popen(
        [*KHR, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={
            **os.environ,
            'ROS_PYTHON_CHECK_FIELDS': '1',
            'COLUMNS': '200',
            **({'COVERAGE_PROCESS_START': str(ROOT / 'pyproject.toml')} if measuring else {}),
        },
        start_new_session=True,
    )


def finish(process, folder, timeout=90):
    try:
        out, err = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=20)
        pytest.fail(f'khr did not end within {timeout} s\n{out}\n{err}')
    return Finished(process.returncode, out, err, folder)


def khr(*arguments, folder=None, timeout=90, measured=False):
    """Run khr to its end."""
    return finish(start_khr(*arguments, measured=measured), folder, timeout)


def children(process):
    """Return the processes of a run by node; one process with all nodes is called graph."""
    running = {}
    for child in psutil.Process(process.pid).children():
        nodes = [
            f'{found[1] or ""}{found[2].lower()}'
            for word in child.cmdline()
            if (found := re.fullmatch(r'(\w+/)?[\w.]+:([A-Z_]+)', word))
        ]
        if nodes:
            running[nodes[0] if len(nodes) == 1 else 'graph'] = child
    return running


def addresses(process):
    """Return the addresses that a run and its nodes are bound to."""
    members = [psutil.Process(process.pid), *children(process).values()]
    return {each.laddr.ip for one in members for each in one.net_connections('inet')}


def interrupt(process, number=signal.SIGINT):
    process.send_signal(number)
    return finish(process, process.folder)


def wait_for(condition, what, seconds=90.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.05)  # polls a condition; the deadline is what fails
    pytest.fail(f'{what} did not come within {seconds} s')


@contextmanager
def joined(folder):
    """Wait for the run of a folder, join its domain, and yield a node there."""
    import rclpy

    from khr_bringup.graph.run_registry import running

    entry = wait_for(
        lambda: next((entry for entry in running() if entry.folder == str(folder)), None),
        'the run',
    )
    with pytest.MonkeyPatch.context() as patch:
        for key, value in entry.environment().items():
            patch.setenv(key, value)
        context = rclpy.Context()
        rclpy.init(args=[], context=context)
        try:
            yield rclpy.create_node('test_client', context=context)
        finally:
            rclpy.try_shutdown(context=context)


def wait_until(node, seconds):
    """Wait until the simulated time is past ``seconds``."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rosgraph_msgs.msg import Clock

    executor = SingleThreadedExecutor(context=node.context)
    reached = rclpy.Future(executor=executor)

    def on_clock(message):
        if message.clock.sec + message.clock.nanosec / 1e9 > seconds and not reached.done():
            reached.set_result(True)

    subscription = node.create_subscription(Clock, 'clock', on_clock, 10)
    rclpy.spin_until_future_complete(node, reached, executor=executor, timeout_sec=80.0)
    assert reached.done()
    node.destroy_subscription(subscription)


def call(node, kind, name, request):
    """Call a service of the run that a node has joined; return its response."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor

    service = node.create_client(kind, name)
    assert service.wait_for_service(60.0)
    executor = SingleThreadedExecutor(context=node.context)
    future = service.call_async(request)
    # On a busy machine the server may answer before it has found us, which we never hear of.
    rclpy.spin_until_future_complete(node, future, executor=executor, timeout_sec=30.0)
    assert future.done(), f'{name} did not answer'
    return future.result()


def wait_until_running(folder):
    """Wait until all nodes of a run are there and its time goes on; return its domain."""
    with joined(folder) as node:
        wait_until(node, seconds=0.0)
        return node.context.get_domain_id()
