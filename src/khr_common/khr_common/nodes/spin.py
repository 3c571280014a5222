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
from khr_common.errors import KhrError, one_line
from khr_common.nodes.node import KhrNode
from khr_common.processes import end_with_parent, report_parents_end

LAST_WORDS = 0.1  # s of wall time for the middleware to send the last messages
PRIVATE = 0o077  # umask: bags and logs are readable by this user alone
LEAVING = 8  # s of wall time for interpreter and middleware to shut down


class SpinUntilIdle:
    """Drain the executor until it is idle or a signal arrives; count the signals.

    Spinning once processes one message, at the cost of two. Spinning with a time limit drains the
    queue, but does not return while messages keep arriving: a signal ends it. The object takes the
    place of the future that the executor waits for: the lock of rclpy's own future may be held by
    the thread that the signal interrupts, and its handler would deadlock.
    """

    def __init__(self) -> None:
        self.signals, self.abandoned = 0, False
        self._stop: Callable[[SpinUntilIdle], None] = _nothing

    def take(self, executor: EventsExecutor) -> None:
        """Process messages for a while; return at once if a signal has come."""
        self._stop = _nothing
        if not self.signals:
            executor.spin_until_future_complete(self, 0.1)

    def add_done_callback(self, stop: Callable[[SpinUntilIdle], None]) -> None:
        """Keep the function that stops the executor; call it now if a signal came just before."""
        self._stop = stop
        if self.signals:
            stop(self)

    def remove_done_callback(self, _: Callable[[SpinUntilIdle], None]) -> bool:
        """Remove the function: the executor has stopped."""
        self._stop = _nothing
        return True

    def interrupt(self, *_: object) -> None:
        """Count a signal and stop the executor: a signal handler."""
        self.signals += 1
        self._stop(self)

    def abandon(self) -> None:
        """Count as two signals: the parent process is gone, and so are the nodes to wait for."""
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
    second signal they wait for no other node. A process that then hangs ends by SIGALRM.
    """
    os.umask(PRIVATE)
    enter()
    spinner = SpinUntilIdle()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, spinner.interrupt)
    classes: list[type[KhrNode]] = [resolve_name(spec.node) for spec in specs]
    _follow_parent(spinner, any(each.keeps for each in classes))
    if not _start_ros(specs[0].name):
        return 2
    executor = EventsExecutor()
    nodes: list[KhrNode] = []
    try:
        for spec, kind in zip(specs, classes, strict=True):
            nodes.append(kind(spec))
            executor.add_node(nodes[-1])
        _join(nodes)
        gc.collect()
        gc.freeze()  # a full garbage collection outlasts a control period
        while not spinner.signals and not any(node.failure for node in nodes):
            spinner.take(executor)
        for node in nodes:
            node.finish()
        for node in nodes:
            _close(node, executor, spinner)
        _spin(executor, LAST_WORDS)
        failed = [node for node in nodes if node.failure]
        for node in failed:
            print(f'{node.label}: {node.failure}', file=sys.stderr, flush=True)
        if spinner.abandoned:
            os._exit(1)  # all is written, and a shutdown may hang on locks of the dead parent
        return int(bool(failed))
    except KhrError as error:
        print(f'{spec.name}: {error}', file=sys.stderr)
        return 2
    finally:
        _close_keepers(nodes)
        _leave(nodes, executor)


def _follow_parent(spinner: SpinUntilIdle, keeps: bool) -> None:
    """End with the parent process; nodes that keep an output are notified and close first."""
    if keeps:
        report_parents_end(spinner.abandon)
    else:
        end_with_parent()


def _start_ros(name: str) -> bool:
    """Initialize ROS with the arguments of the process; return whether they are accepted."""
    try:
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:  # such as a parameter file that is missing
        print(f'{name}: arguments of ROS: {one_line(str(error))}', file=sys.stderr)
        return False
    return True


def _join(nodes: Sequence[KhrNode]) -> None:
    """Make the nodes of this process known to one another."""
    for node in nodes:
        node.join([other for other in nodes if other is not node])


def _close_keepers(nodes: Sequence[KhrNode]) -> None:
    """Close the nodes that an exception left open and that keep something: a robot, a recording.

    One that cannot be closed must not keep the others open, nor hide the exception.
    """
    for node in nodes:
        if node.closed or not node.keeps:
            continue
        node.closed = True
        try:
            node.close()
        except Exception as error:
            node.fail(f'{type(error).__name__}: {error}')
        if node.failure:
            print(f'{node.label}: {node.failure}', file=sys.stderr, flush=True)


def _leave(nodes: Sequence[KhrNode], executor: EventsExecutor) -> None:
    """Shut the middleware down, ignoring further signals, in limited time.

    Nodes are destroyed here. Nodes left to the end of the process would be destroyed with the
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


def _nothing(_: SpinUntilIdle) -> None:
    """Do nothing: no executor spins."""


def _close(node: KhrNode, executor: EventsExecutor, spinner: SpinUntilIdle) -> None:
    """Let a node receive pending messages, and close it.

    A closed node receives nothing more, since the resources of its callbacks are released.
    """
    end = time.monotonic() + node.patience
    while spinner.signals < 2 and not node.settled() and time.monotonic() < end:
        executor.spin_once(0.02)
    node.closed = True  # stays on the executor: removing it can crash pending callbacks
    node.close()


def _spin(executor: EventsExecutor, seconds: float) -> None:
    """Spin for some time, so that the middleware sends the last messages."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_once(0.02)
