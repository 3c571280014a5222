"""How nodes end: by a signal at any moment; one that has closed receives nothing more."""

import os
import signal
import subprocess
import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.parameter import Parameter
from std_msgs.msg import String

from khr_common import parameter
from khr_common.interfaces import READY
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import SpinUntilIdle, _close, _spin
from khr_sim.sensors import GYRO

# A signal handler runs between two lines of Python, so it is called at each of them in turn.
INTERRUPTED = """
import itertools, sys
import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from khr_common.nodes.spin import SpinUntilIdle

rclpy.init(args=[])
executor = EventsExecutor()
for moment in itertools.count(1):
    spinner, lines = SpinUntilIdle(), itertools.count(1)

    def trace(frame, event, _):
        if event == 'line' and next(lines) == moment:
            spinner.interrupt()
        return trace

    sys.settrace(trace)
    spinner.take(executor)
    sys.settrace(None)
    if not spinner.signals:
        print(moment)
        break
"""


@dataclass(frozen=True)
class Table:
    """One number."""

    loud: float = parameter(0.0, 'How loud.')


class Talkative(KhrNode):
    """It hears itself all the time."""

    patience = 20.0

    def __init__(self):
        super().__init__(replace(GYRO, name='talkative', table=Table))
        self.heard, self.configured = {False: 0, True: 0}, {False: 0, True: 0}
        publisher = self.publisher(READY)
        self.subscribe(READY, self._on_talk)
        self.create_timer(0.001, lambda: self._talk(publisher))

    def _talk(self, publisher):
        publisher.publish(String())
        self.set_parameters([Parameter('loud', value=1.0 - self.parameters.loud)])

    def configure(self, _):
        self.configured[self.closed] += 1

    def _on_talk(self, _):
        self.heard[self.closed] += 1

    def settled(self):
        return self.heard[False] > 3 and self.configured[False] > 3


def test_a_closed_node_receives_nothing_more(monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    rclpy.init(args=[])
    try:
        node, executor = Talkative(), EventsExecutor()
        executor.add_node(node)
        _close(node, executor, SimpleNamespace(signals=0))
        _spin(executor, 0.1)
    finally:
        rclpy.try_shutdown()
    assert node.closed
    assert node.heard[False] > 3 and node.configured[False] > 3
    assert node.heard[True] == node.configured[True] == 0


# Two nodes keep something, the first of which cannot be closed, and the last node has a bug.
BROKEN = """
import sys
from dataclasses import dataclass
from khr_common.block import NodeSpec
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import run_nodes

@dataclass(frozen=True)
class Table:
    pass

class Keeping(KhrNode):
    keeps = True

    def close(self):
        print(f'{self.label} closes, {self.context.ok()}', flush=True)
        if self.label == 'robot':
            raise RuntimeError('no answer')

class Broken(KhrNode):
    def __init__(self, spec):
        super().__init__(spec)
        self.by_wall_clock(0.05, self.fall)

    def fall(self):
        raise ValueError('a bug in another node')

kinds = {'robot': 'Keeping', 'recorder': 'Keeping', 'broken': 'Broken'}
sys.exit(run_nodes([
    NodeSpec(name, 'khr_common', Table, node=f'__main__:{kind}') for name, kind in kinds.items()
]))
"""


def test_an_exception_in_a_node_closes_the_others_that_keep_something():
    done = run_python(BROKEN)
    assert done.stdout.splitlines() == ['robot closes, True', 'recorder closes, True']
    assert done.returncode == 1 and 'ValueError: a bug in another node' in done.stderr
    assert 'robot: RuntimeError: no answer' in done.stderr


# What hangs at the end of a process comes after all is closed.
STUCK = """
import atexit, sys, time
from khr_common.nodes import spin
from khr_sim.sensors import GYRO

spin.LEAVING = 1
spin.SpinUntilIdle.take = lambda spinner, executor: spinner.interrupt()
atexit.register(time.sleep, 60.0)
sys.exit(spin.run_node(GYRO))
"""


def run_python(text):
    return subprocess.run(
        [sys.executable, '-c', text],
        env={**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'OFF'},
        capture_output=True,
        text=True,
        timeout=50,
    )


def test_a_process_that_does_not_get_away_is_ended_once_it_has_closed():
    assert run_python(STUCK).returncode == -signal.SIGALRM


def test_a_signal_at_any_moment_ends_a_turn():
    done = run_python(INTERRUPTED)
    assert int(done.stdout) > 5, done.stderr


def test_an_orphan_waits_for_nobody_before_it_closes():
    spinner, closed = SpinUntilIdle(), []
    spinner.abandon()
    never = SimpleNamespace(patience=20.0, settled=lambda: False, close=lambda: closed.append(1))
    _close(never, None, spinner)  # without an executor to spin
    assert closed
