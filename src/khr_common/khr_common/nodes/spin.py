"""Run nodes on one executor, from their start to a clean end."""

from __future__ import annotations

import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from pkgutil import resolve_name

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from khr_common.arithmetic import enter
from khr_common.block import NodeSpec
from khr_common.errors import KhrError
from khr_common.lifeline import end_with_parent, report_parents_end
from khr_common.nodes.node import KhrNode

LAST_WORDS = 0.1  # s of wall time for the middleware to send what was published last
PRIVATE = 0o077  # umask: bags and logs are for this user alone
LEAVING = 8  # s of wall time for interpreter and middleware to let go


class Turn:
    """Process messages until there are none, or a signal comes; count the signals.

    To spin once is to process one message, and costs as much as to process two. Spinning with a
    time limit processes all, but while messages keep coming it does not return: a signal ends it.
    To the executor a turn is the future that it waits for. rclpy's own would not do: its lock may
    be held by the thread that a signal interrupts, and then the handler deadlocks.
    """

    def __init__(self) -> None:
        self.signals, self.abandoned = 0, False
        self._stop: Callable[[Turn], None] = _nothing

    def take(self, executor: EventsExecutor) -> None:
        """Process messages for a while; return at once if a signal has come."""
        self._stop = _nothing
        if not self.signals:
            executor.spin_until_future_complete(self, 0.1)

    def add_done_callback(self, stop: Callable[[Turn], None]) -> None:
        """Keep what stops the executor; a signal that came just before stops it now."""
        self._stop = stop
        if self.signals:
            stop(self)

    def remove_done_callback(self, _: Callable[[Turn], None]) -> bool:
        """Forget it: the executor has stopped."""
        self._stop = _nothing
        return True

    def interrupt(self, *_: object) -> None:
        """Count a signal and stop the executor: a signal handler."""
        self.signals += 1
        self._stop(self)

    def abandon(self) -> None:
        """Count as two signals: who started this process is gone, and with it whom it waits for."""
        self.abandoned = True
        self.signals += 1
        self.interrupt()


def run_node(spec: NodeSpec) -> int:
    """Run one node in this process until it ends or is interrupted; return the exit code."""
    return run_nodes([spec])


def run_nodes(specs: Sequence[NodeSpec]) -> int:
    """Run nodes on one executor until one ends or they are interrupted; return the exit code.

    ROS's own signal handlers tear the context down before a node could publish a last message, so
    SIGINT and SIGTERM are only counted here, and nodes close while they can still publish. After a
    second one they wait for nobody. A process that then does not get away ends by SIGALRM.
    """
    os.umask(PRIVATE)
    enter()
    turn = Turn()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, turn.interrupt)
    classes: list[type[KhrNode]] = [resolve_name(spec.node) for spec in specs]
    if any(each.keeps for each in classes):
        report_parents_end(turn.abandon)
    else:
        end_with_parent()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    executor = EventsExecutor()
    nodes: list[KhrNode] = []
    try:
        for spec, kind in zip(specs, classes, strict=True):
            nodes.append(kind(spec))
            executor.add_node(nodes[-1])
        gc.collect()
        gc.freeze()  # a full garbage collection outlasts a control period
        while not turn.signals and not any(node.failure for node in nodes):
            turn.take(executor)
        for node in nodes:
            node.finish()
        for node in nodes:
            _close(node, executor, turn)
        _spin(executor, LAST_WORDS)
        failed = [node for node in nodes if node.failure]
        for node in failed:
            print(f'{node.get_name()}: {node.failure}', file=sys.stderr, flush=True)
        if turn.abandoned:  # all is written, and the middleware may hang on what the dead one held
            os._exit(1)
        return int(bool(failed))
    except KhrError as error:
        print(f'{spec.name}: {error}', file=sys.stderr)
        return 2
    finally:
        _leave(nodes, executor)


def _leave(nodes: Sequence[KhrNode], executor: EventsExecutor) -> None:
    """Let go of the middleware, all being closed: deaf to signals, but in time.

    Nodes are destroyed here. What is left to the end of the process is destroyed with the
    library's own static objects, while its threads still receive: that can crash.
    """
    for number in (signal.SIGINT, signal.SIGTERM):  # a launch may send another
        signal.signal(number, signal.SIG_IGN)
    # Fast DDS 2.14 may still deadlock if others leave while it destroys its participant
    # (DomainParticipant::set_listener); then the alarm ends the process.
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.alarm(LEAVING)
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def _nothing(_: Turn) -> None:
    """Stop nothing: no executor spins."""


def _close(node: KhrNode, executor: EventsExecutor, turn: Turn) -> None:
    """Let a node receive what is on its way, and close it.

    A node that closes receives nothing more: it may have let go of what its callbacks need.
    """
    end = time.monotonic() + node.patience
    while turn.signals < 2 and not node.settled() and time.monotonic() < end:
        executor.spin_once(0.02)
    node.closed = True  # stays on the executor: removing it can crash pending callbacks
    node.close()


def _spin(executor: EventsExecutor, seconds: float) -> None:
    """Go on for a while: the middleware sends what was published last."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(0.02)
