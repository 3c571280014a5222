"""Follow a run from its first instant to its verdict, from whatever process."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from khr_analysis.node_specs import MONITOR, RECORDER
from khr_bringup.changes import effective
from khr_bringup.graph.wiring import START_TIMEOUT, nodes_of
from khr_bringup.node_registry import spec_of
from khr_bringup.result import Progress, Result
from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_common.interfaces import DIAGNOSTICS, READY, TF, TF_STATIC
from khr_common.punctuality import RealTime
from khr_common.text.quoting import one_line
from khr_sim.run_parameters import RunParameters

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
SILENCE = 15.0  # s of wall time without a report of the simulator; it sends one every second
LAST_WORDS = 4.0  # s of wall time for the outcome of a run that was interrupted; launch waits 5


def follow(
    scenario: Scenario,
    listeners: Sequence[str],
    run: str,
    interrupted: Sequence[int],
    *,
    show: Callable[[Progress], None] = lambda _: None,
    ended: Callable[[], str | None] = lambda: None,
    left: Callable[[], list[str]] = list,
    stay: bool = False,
    interrupt: Callable[[], None] = lambda: None,
    simulator: str = 'simulator',
    arguments: Sequence[str] = (),
    folder: Path | None = None,
) -> Result:
    """Follow a run until it is over, received by all and judged.

    Args:
        scenario: of the run.
        listeners: the nodes that must receive the whole run.
        run: its identity.
        interrupted: the signals that were caught so far.
        show: called some times a second.
        ended: describes a process of the run that has ended, if one has.
        left: describes processes beside the run that have ended since it was asked last.
        stay: whether to go on after the end of the run, until a signal.
        interrupt: called once, at the first signal.
        simulator: the process that has the simulator.
        arguments: of ROS, such as the namespace.
        folder: of the run, for the scenarios that it is switched to.

    Raises:
        RunError: if a node has ended, or does not appear or answer in time; it is named.
    """
    import rclpy
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.signals import SignalHandlerOptions

    from khr_bringup.graph.run_monitor import Watcher

    began = time.monotonic()
    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    table = scenario.table(RunParameters)
    # In realtime a node may fall silent and the run goes on, so not all can receive all of it.
    awaited = listeners if table.sync == 'lockstep' else ()
    watcher = Watcher(
        awaited, run, _owners(scenario, RECORDER.name in listeners), folder, scenario.driver
    )
    watcher.view.judges = MONITOR.name in scenario.nodes
    executor = EventsExecutor()
    executor.add_node(watcher)
    view, deadline = watcher.view, float('inf')
    try:
        while (not view.over or (stay and not interrupted)) and time.monotonic() < deadline:
            executor.spin_once(0.1)
            view.warnings += left()
            show(view.progress)
            if interrupted and deadline == float('inf'):
                deadline = time.monotonic() + LAST_WORDS
                interrupt()
            trouble = watcher.stranger()
            if not (interrupted or view.over):
                trouble = trouble or ended() or _silent(view, simulator) or _unfinished(view)
            if trouble is not None:
                raise RunError(f'{trouble}; the run was stopped')
    finally:
        executor.remove_node(watcher)
        watcher.destroy_node()
        rclpy.try_shutdown()
    return _result(view, scenario, began)


def _result(view: Any, scenario: Scenario, began: float) -> Result:
    values = view.state_values
    if values.get('end') == 'error':
        raise RunError(f'{one_line(values.get("reason", ""))}; the run was stopped')
    now = time.monotonic()
    ran = view.scenario or scenario
    return Result(
        scenario=ran,
        judged=view.judged,
        trajectory_hash=values.get('trajectory_hash', ''),
        end=values.get('end') or 'stopped',  # stopped: interrupted before it began
        time=int(values.get('time_ns', 0)) / 1e9,
        startup=(view.started or now) - began,
        wall_time=view.ran + (now - view.entered if view.state == 'running' else 0.0),
        realtime=RealTime.read(values),
        changes=effective(view.changes, ran),
        warnings=tuple(view.complaints),
    )


def _owners(scenario: Scenario, record: bool) -> dict[str, str]:
    """Return the owner of each topic on which nobody else may publish.

    Left out is what has several sources, and what carries the run's identity in every message.
    """
    sources = {node: spec_of(node).publishes for node in nodes_of(scenario, record)}
    if scenario.driver is not None:
        sources[scenario.driver.name] = scenario.driver.publishes
    return {
        topic.name: node
        for node, topics in sources.items()
        for topic in topics
        if topic not in (DIAGNOSTICS, READY, TF, TF_STATIC) and not topic.of_run
    }


def _silent(view: Any, simulator: str) -> str | None:
    """Describe the process of a simulator that has not reported for long: it keeps the clock."""
    silent = time.monotonic() - view.alive
    if (
        silent < (START_TIMEOUT if view.state == 'starting' else SILENCE)
        or view.state == 'finished'
    ):
        return None
    return f'{simulator} has not reported for {silent:.0f} s'


def _unfinished(view: Any) -> str | None:
    """Return what is missing of a finished run if nothing has come for long."""
    if view.state != 'finished' or time.monotonic() - view.news < START_TIMEOUT:
        return None
    return (
        'the run ended, but not all of it was received: ' + ', '.join(view.behind)
        if view.behind
        else 'the monitor did not judge the run'
    )


@contextmanager
def interrupts() -> Iterator[list[int]]:
    """Collect the signals that ask a process to end, instead of dying of them."""
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
