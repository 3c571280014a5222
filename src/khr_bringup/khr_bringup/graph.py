"""A run as a real node graph: start it, watch it, end it, keep what it leaves."""

from __future__ import annotations

import os
import resource
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from khr_bringup.code_version import as_run
from khr_bringup.following import PATIENCE, GraphResult, follow, interrupts, nodes_of
from khr_bringup.node_registry import registry, spec_of
from khr_bringup.processes import Processes, unhurried
from khr_bringup.run_registry import WITHOUT_LOG, RunEntry
from khr_bringup.scenario import Scenario
from khr_common import RunError
from khr_common.files import write_text
from khr_common.interfaces import LOG, PARAMETER_EVENTS, PUSH
from khr_sim.run_parameters import RunParameters

LEAST_MEMORY = 2**31  # bytes of address space; a process of a run takes about 1.2e9


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
    write_text(parameters, as_run(scenario))
    os.environ.update(entry.environment())
    nodes = nodes_of(scenario, record)
    processes = Processes(entry.environment(), folder / 'log', entry.lock)
    patient = not one_process and scenario.table(RunParameters).sync == 'lockstep'
    with interrupts() as interrupted, unhurried() if patient else nullcontext():
        try:
            entries = {node: registry()[node].entry for node in nodes}
            for name, group in (
                {'graph': nodes} if one_process else {n: [n] for n in nodes}
            ).items():
                processes.start(name, [entries[node] for node in group], parameters)
            beside(processes)
            simulator = 'graph' if one_process else 'simulator'
            result = follow(
                scenario,
                entry.run,
                interrupted,
                show=show,
                ended=processes.ended,
                left=processes.left,
                stay=stay,
                interrupt=lambda: processes.interrupt(simulator),
                simulator=simulator,
                arguments=WITHOUT_LOG,
            )
        finally:
            failure = processes.stop()
    return replace(result, failure=failure or '')


def _check_memory() -> None:
    """Refuse a limit under which the middleware's threads would be killed at some time."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
        raise RunError(
            f'ulimit -v: {limit // 1024} kB of address space is too small; accepted: at least '
            f'{LEAST_MEMORY // 1024} kB'
        )
