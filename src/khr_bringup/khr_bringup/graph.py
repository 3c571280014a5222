"""A run as a real node graph: start it, watch it, end it, keep what it leaves."""

from __future__ import annotations

import os
import resource
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from khr_analysis.node_specs import RECORDER
from khr_bringup.code_version import MARK, version_of
from khr_bringup.node_registry import registry, spec_of
from khr_bringup.processes import Processes
from khr_bringup.run_registry import WITHOUT_LOG, RunEntry
from khr_bringup.scenario import Scenario
from khr_common import RunError
from khr_common.files import write_text
from khr_common.interfaces import DIAGNOSTICS, JOINT_STATE, LOG, PARAMETER_EVENTS, PUSH, READY
from khr_sim.run_parameters import RunParameters

# s of wall time for nodes to appear, and for listeners to acknowledge the end: a loaded machine
# is slow, not broken.
PATIENCE = 30.0
SILENCE = 15.0  # s of wall time without a report of the simulator; it sends one every second
LEAST_MEMORY = 2**31  # bytes of address space; a process of a run takes about 1.2e9
LAST_WORDS = 5.0  # s of wall time for the outcome of a run that was interrupted


@dataclass(frozen=True)
class GraphResult:
    """What a run over topics leaves.

    Attributes:
        verdict: walked, stood, fell, slipped; empty if the graph never said.
        outcome: the monitor's quantities, as texts by name.
        trajectory_hash: SHA-256 in hex; empty if the run did not start.
        end: why it ended: duration, tilted, stopped.
        started: when the first period began, s of ``time.monotonic``.
        ended: when the last one was over.
        warnings: what nodes complained of in /diagnostics.
        failure: which process did not end well after the run; empty if all did.
    """

    verdict: str
    outcome: dict[str, str]
    trajectory_hash: str
    end: str
    started: float
    ended: float
    warnings: tuple[str, ...]
    failure: str = ''


def prepare(scenario: Scenario, folder: Path, record: bool) -> Scenario:
    """Fill in what a graph run needs beyond its scenario: its nodes, its topics, its bag."""
    nodes = [spec_of(node) for node in nodes_of(scenario, record)]
    topics = {topic.name: topic for spec in nodes for topic in spec.publishes}
    topics |= {topic.name: topic for topic in (PUSH, PARAMETER_EVENTS, LOG)}
    return scenario.changed(
        {
            ('simulator', 'answers'): scenario.answers,
            ('simulator', 'listeners'): [spec.name for spec in nodes if spec.listens],
            ('simulator', 'start_timeout'): PATIENCE,
            ('recorder', 'folder'): str(folder / 'bag'),
            ('recorder', 'scenario_file'): str(folder / 'scenario.yaml'),
            ('recorder', 'topics'): [topic.line for topic in topics.values()],
        }
    )


def nodes_of(scenario: Scenario, record: bool) -> list[str]:
    """Return the nodes that a run of a scenario needs."""
    return [node for node in scenario.nodes if record or node != RECORDER.name]


def run_graph(
    scenario: Scenario,
    folder: Path,
    entry: RunEntry,
    *,
    record: bool = True,
    one_process: bool = False,
    show: Callable[[Any], None] = lambda _: None,
    beside: Callable[[Processes], None] = lambda _: None,
    stay: bool = False,
) -> GraphResult:
    """Run a prepared scenario over topics until it ends or is interrupted.

    Args:
        scenario: from :func:`prepare`; it is written to ``folder/scenario.yaml``.
        folder: the run's folder.
        entry: the domain the run lives in.
        record: start the recorder.
        one_process: all nodes in one process instead of one each.
        show: called some times a second with the :class:`~khr_bringup.run_monitor.View`.
        beside: starts what looks on at the run, which goes on without it.
        stay: keep the graph when the run is over, for a reset, until it is interrupted.

    Raises:
        RunError: if a node dies, or does not appear or answer in time; it is named, the rest
            is stopped and the bag closed.
    """
    _check_memory()
    parameters = folder / 'scenario.yaml'
    write_text(parameters, f'{scenario.to_yaml()}{MARK}{version_of(scenario)}\n')
    os.environ.update(entry.environment())
    nodes = nodes_of(scenario, record)
    processes = Processes(entry.environment(), folder / 'log', entry.lock)
    with _interrupts() as interrupted:
        try:
            entries = {node: registry()[node].entry for node in nodes}
            for name, group in (
                {'graph': nodes} if one_process else {n: [n] for n in nodes}
            ).items():
                processes.start(name, [entries[node] for node in group], parameters)
            beside(processes)
            result = _watch(
                processes,
                (_awaited(scenario.table(RunParameters)), entry.run, _owners(nodes)),
                interrupted,
                show,
                'graph' if one_process else 'simulator',
                stay,
            )
        finally:
            failure = processes.stop()
    return replace(result, failure=failure or '')


def _watch(
    processes: Processes,
    watched: tuple[Sequence[str], str, Mapping[str, str]],
    interrupted: list[int],
    show: Callable[[Any], None],
    simulator: str,
    stay: bool,
) -> GraphResult:
    import rclpy
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.signals import SignalHandlerOptions

    from khr_bringup.run_monitor import Watcher

    rclpy.init(args=WITHOUT_LOG, signal_handler_options=SignalHandlerOptions.NO)
    watcher = Watcher(*watched)
    executor = EventsExecutor()
    executor.add_node(watcher)
    view, deadline = watcher.view, float('inf')
    try:
        while (stay or not view.over) and time.monotonic() < deadline:
            executor.spin_once(0.1)
            view.warnings += processes.left()
            show(view)
            if interrupted:
                stay = False
            if interrupted and deadline == float('inf'):
                deadline = time.monotonic() + LAST_WORDS
                processes.interrupt(simulator)
            trouble = watcher.stranger()
            if not (interrupted or view.over):
                trouble = trouble or processes.ended() or _silent(view, simulator)
                trouble = trouble or _unfinished(view)
            if trouble is not None:
                raise RunError(f'{trouble}; the run was stopped')
    finally:
        executor.remove_node(watcher)
        watcher.destroy_node()
        rclpy.try_shutdown()
    values = view.state_values
    if values.get('end') == 'error':
        raise RunError(f'{values["reason"]}; the run was stopped')
    ended = view.entered.get('finished', time.monotonic())
    return GraphResult(
        view.verdict,
        view.outcome,
        values.get('trajectory_hash', ''),
        values.get('end') or 'stopped',  # the second if interrupted before it began
        view.entered.get('running', ended),
        ended,
        tuple(view.warnings),
    )


def _check_memory() -> None:
    """Refuse a limit under which the middleware's threads would be killed at some time."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
        raise RunError(
            f'ulimit -v: {limit // 1024} kB of address space is too small; accepted: at least '
            f'{LEAST_MEMORY // 1024} kB'
        )


def _owners(nodes: Sequence[str]) -> dict[str, str]:
    """Return the owner of each topic on which nobody else may publish.

    Left out is what has several sources, and what carries the run's identity in every message.
    """
    return {
        topic.name: node
        for node in nodes
        for topic in spec_of(node).publishes
        if topic not in (DIAGNOSTICS, READY) and topic.kind != JOINT_STATE
    }


def _silent(view: Any, simulator: str) -> str | None:
    """Describe the process of a simulator that has not reported for long: it keeps the clock."""
    silent = time.monotonic() - view.alive
    if silent < (PATIENCE if view.state == 'starting' else SILENCE) or view.state == 'finished':
        return None
    return f'{simulator} has not reported for {silent:.0f} s'


def _awaited(simulator: RunParameters) -> Sequence[str]:
    """Return who must have received all of the run before it is over."""
    # In realtime a node may fall silent and the run goes on, so not all can receive all of it.
    return simulator.listeners if simulator.sync == 'lockstep' else ()


def _unfinished(view: Any) -> str | None:
    """Tell what is missing of a finished run if nothing has come for long."""
    if view.state != 'finished' or time.monotonic() - view.news < PATIENCE:
        return None
    return (
        'the run ended, but not all of it was received: ' + ', '.join(view.behind)
        if view.behind
        else 'the monitor did not judge the run'
    )


@contextmanager
def _interrupts() -> Any:
    """Collect SIGINT and SIGTERM instead of dying of them."""
    caught: list[int] = []
    before = {
        number: signal.signal(number, lambda number, _: caught.append(number))
        for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
