"""Follow a run from its first sample to its verdict, from any process."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING

from khr_analysis.outcome import MONITOR, SENSED
from khr_analysis.recorder_parameters import RECORDER
from khr_bringup.graph.wiring import START_TIMEOUT, Robots
from khr_bringup.result import Progress, Result
from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_common.errors import one_line
from khr_common.interfaces import DIAGNOSTICS, FINISHED, READY, TF, TF_STATIC, Topic
from khr_common.pacing import RealTime
from khr_sim.run_parameters import RunParameters

if TYPE_CHECKING:
    from khr_bringup.graph.reports import Reports, View
    from khr_bringup.graph.run_monitor import Watcher
    from khr_bringup.graph.run_registry import RunEntry

OF_MANY = tuple(f'/{topic.name}' for topic in (DIAGNOSTICS, READY, TF, TF_STATIC))
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SAMPLES = 12.0  # s of wall time for the first whole sample of a driver
SILENCE = 15.0  # s of wall time without a report of the simulator; it sends one every second
LAST_WORDS = 4.0  # s of wall time for the outcome of a run that was interrupted; launch waits 5


@dataclass(frozen=True)
class Callbacks:
    """Functions that a run calls."""

    # called with the entry of a graph before its nodes start
    started: Callable[[RunEntry], None] = lambda _: None
    progress: Callable[[Progress], None] = lambda _: None  # called many times a second
    # context manager entered while ROS is up, such as the observer of the page
    observed: Callable[[], AbstractContextManager[object]] = nullcontext
    finish: Callable[[], bool] = lambda: False  # returns True to end the graph now
    interrupted: Callable[[], None] = lambda: None  # called when a signal has ended the graph
    # handles a request for another scenario; None if requests are not served
    switch: Callable[[str, str], None] | None = None


def follow(
    robots: Robots,
    listeners: Sequence[str],
    run: str,
    callbacks: Callbacks,
    *,
    failed: Callable[[], str | None] = lambda: None,
    stop: Callable[[], None] = lambda: None,
    endless: bool = False,
    simulator: str = 'simulator',
    arguments: Sequence[str] = (),
) -> list[Result]:
    """Follow a run until it is over, received by all listeners and judged.

    Args:
        robots: of the run.
        listeners: the nodes that must receive the whole run.
        run: its identity.
        callbacks: to call meanwhile.
        failed: returns a description of a process that ended early, else None.
        stop: called once, when the run is to end.
        endless: whether to go on after the end of the run, until asked to finish.
        simulator: the process that has the simulator.
        arguments: of ROS, such as the namespace.

    Returns:
        The result of each robot.

    Raises:
        RunError: if a node has ended, or does not appear or answer in time; it is named.
    """
    import rclpy
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.signals import SignalHandlerOptions

    from khr_bringup.graph.run_monitor import Watcher

    began = time.monotonic()
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    # In realtime mode the run goes on without a silent node, so not all can receive the whole run.
    lockstep = robots.first.table(RunParameters).sync == 'lockstep'
    owners = _owners(robots, RECORDER.name in listeners)
    watcher = Watcher(
        listeners if lockstep else (),
        run,
        owners,
        callbacks.switch,
        _sensors(robots.first),
        [robot for robot, each in robots.scenarios.items() if MONITOR.name in each.nodes],
        referee=bool(robots.places),
    )
    reports, deadline = watcher.reports, inf
    view = reports.view
    executor = EventsExecutor()
    executor.add_node(watcher)
    try:
        with callbacks.observed():
            while (
                not reports.over or (endless and deadline == inf)
            ) and time.monotonic() < deadline:
                executor.spin_once(0.1)
                callbacks.progress(reports.progress)
                if deadline == inf and callbacks.finish():
                    judged = view.state != 'starting'  # else no outcome is to come
                    deadline = time.monotonic() + judged * LAST_WORDS
                    stop()
                trouble = watcher.stranger()
                if not (deadline < inf or reports.over):
                    trouble = trouble or failed() or _silent(view, simulator)
                    trouble = trouble or _unjudged(watcher) or _unfinished(reports)
                if trouble is not None:
                    raise RunError(f'{trouble}; the run was stopped')
    finally:
        executor.remove_node(watcher)
        watcher.destroy_node()
        rclpy.try_shutdown()
    return [
        replace(
            _result(reports.views[robot], scenario, began),
            decision=reports.decision,
            warnings=(*reports.complaints, *watcher.sensors.notes),
        )
        for robot, scenario in robots.scenarios.items()
    ]


def _result(view: View, scenario: Scenario, began: float) -> Result:
    values = view.state_values
    if values.get('end') == 'error':
        raise RunError(f'{one_line(values.get("reason", ""))}; the run was stopped')
    now = time.monotonic()
    return Result(
        scenario=scenario,
        judged=view.judged,
        trajectory_hash=values.get('trajectory_hash', ''),
        end=values.get('end') or 'stopped',  # stopped: interrupted before it began
        time=int(values.get('time_ns', 0)) / 1e9,
        startup=(view.started or now) - began,
        wall_time=view.ran + (now - view.entered if view.state == 'running' else 0.0),
        realtime=RealTime.read(values),
        changes=tuple(view.changes),
    )


def _owners(robots: Robots, record: bool) -> dict[str, str]:
    """Return the owner of each topic that only one node may publish.

    Topics with several publishers are skipped, and topics with the run's identity in each message.
    """
    published = [(each.node, robots.publishes(each)) for each in robots.members(record)]
    if (driver := robots.first.driver) is not None:
        published.append((driver.name, [*driver.publishes]))
    return {
        topic.name: node
        for node, topics in published
        for topic in topics
        if not (topic.of_run or f'/{topic.name}'.endswith(OF_MANY))
    }


def _silent(view: View, simulator: str) -> str | None:
    """Return an error if the simulator has not reported before its timeout, else None."""
    silent = time.monotonic() - view.alive
    if silent < (START_TIMEOUT if view.state == 'starting' else SILENCE) or view.state == FINISHED:
        return None
    return f'{simulator} has not reported for {silent:.0f} s'


def _sensors(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topics of a driver of its own that judge a run."""
    driver = scenario.driver
    if driver is None or driver.path is None or driver.judged_by != 'sensors':
        return ()
    return tuple(topic for topic in SENSED if topic in driver.publishes)


def _unjudged(watcher: Watcher) -> str | None:
    """Return an error if the samples of a driver make no run before a timeout, else None."""
    view = watcher.reports.view
    begun = view.started and time.monotonic() - max(view.started, view.judged_at)
    if not (begun and begun > SAMPLES and not view.final):
        return None
    faults = watcher.sensors.faults()
    return f'the run cannot be judged: {"; ".join(faults)}' if faults else None


def _unfinished(reports: Reports) -> str | None:
    """Return an error if parts of a finished run miss the timeout, else None."""
    if reports.view.state != FINISHED or time.monotonic() - reports.news < START_TIMEOUT:
        return None
    return (
        'the run ended, but not all of it was received: ' + ', '.join(reports.behind)
        if reports.behind
        else f'{" and ".join(reports.unjudged)} did not judge the run'
    )


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Collect the signals that ask a process to end, instead of ending at once."""
    caught: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: caught.append(number))
        for number in ENDING
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN  # nohup
    }
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
