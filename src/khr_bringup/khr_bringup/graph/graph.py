"""A run as a real node graph: start it, watch it, end it, keep what it leaves."""

from __future__ import annotations

import json
import os
import resource
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from khr_bringup.code_version import as_run
from khr_bringup.graph.following import PATIENCE, follow, interrupts, nodes_of
from khr_bringup.graph.intruders import Intruders
from khr_bringup.graph.processes import Processes, unhurried
from khr_bringup.graph.run_registry import WITHOUT_LOG, RunEntry
from khr_bringup.node_registry import registry, spec_of
from khr_bringup.result import Progress, Result
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_common.files import write_text
from khr_common.interfaces import CLOCK, LOG, PARAMETER_EVENTS, PUSH
from khr_sim.run_parameters import RunParameters

LEAST_MEMORY = 2**31  # bytes of address space; a process of a run takes about 1.2e9


@dataclass(frozen=True)
class Way:
    """How to run a scenario.

    Attributes:
        offline: without ROS.
        one_process: all nodes in one process instead of one each.
        record: whether to write a bag.
        domain: of ROS; a free one by default.
        network: whether other machines may join.
        stay: whether the graph stays until it is interrupted, and may be started anew.
        driver_parameters: file for the executable that drives, if one does.
    """

    offline: bool = False
    one_process: bool = False
    record: bool = True
    domain: int | None = None
    network: bool = False
    stay: bool = False
    driver_parameters: Path | None = None


@dataclass(frozen=True)
class Hooks:
    """What looks on at a run.

    Attributes:
        begun: called with the entry of a graph before its nodes start.
        show: called many times a second.
        beside: starts what looks on at a graph, which goes on without it.
    """

    begun: Callable[[RunEntry], None] = lambda _: None
    show: Callable[[Progress], None] = lambda _: None
    beside: Callable[[Processes], None] = lambda _: None


def prepare(scenario: Scenario, folder: Path, record: bool) -> Scenario:
    """Fill in what a graph run needs beyond its scenario: its nodes, its topics, its bag."""
    nodes = [spec_of(node) for node in nodes_of(scenario, record)]
    driver = scenario.driver
    sources = [
        *(driver.publishes if driver else ()),
        *(t for spec in nodes if not spec.drives for t in spec.publishes),
    ]
    topics = {topic.name: topic for topic in (*sources, PUSH, PARAMETER_EVENTS, LOG)}
    if driver and scenario.table(RunParameters).sync == 'realtime':
        # Of what others publish not each instant is there, nor under the stamp of the clock.
        free = {name: replace(topic, flow='event') for name, topic in topics.items()}
        topics |= {n: free[n] for n, t in topics.items() if t.flow == 'period' and t != CLOCK}
    return scenario.changed(
        {
            ('simulator', 'answers'): scenario.answers,
            ('simulator', 'listeners'): [spec.name for spec in nodes if spec.listens],
            ('simulator', 'start_timeout'): PATIENCE,
            ('recorder', 'folder'): str(folder / 'bag'),
            ('recorder', 'scenario_file'): str(folder / SCENARIO),
            ('recorder', 'topics'): [topic.line for topic in topics.values()],
        }
    )


def run_graph(scenario: Scenario, folder: Path, entry: RunEntry, way: Way, hooks: Hooks) -> Result:
    """Run a prepared scenario over topics until it ends or is interrupted.

    Args:
        scenario: from :func:`prepare`; it is written to ``folder/scenario.yaml``.
        folder: the run's folder.
        entry: the domain the run lives in.
        way: how to run it.
        hooks: what looks on.

    Raises:
        RunError: if a node dies, or does not appear or answer in time, or another user joins;
            it is named, the rest is stopped and the bag closed.
    """
    _check_memory()
    began = time.monotonic()
    parameters = folder / SCENARIO
    write_text(parameters, as_run(scenario))
    os.environ.update(entry.quiet_environment())
    nodes = nodes_of(scenario, way.record)
    first = scenario.driver.first if scenario.driver else 'simulator'
    intruders = Intruders(entry.domain)
    processes = Processes(entry.environment(), folder / 'log', entry.locks, first)
    patient = not way.one_process and scenario.table(RunParameters).sync == 'lockstep'
    with interrupts() as interrupted, unhurried() if patient else nullcontext():
        try:
            entries = {node: registry()[node].entry for node in nodes}
            for name, group in (
                {'graph': nodes} if way.one_process else {n: [n] for n in nodes}
            ).items():
                processes.start(name, [entries[node] for node in group], parameters)
            if scenario.driver is not None and scenario.driver.path is not None:
                processes.start_executable(
                    scenario.driver.name,
                    scenario.driver.path,
                    _arguments(scenario, way.driver_parameters),
                )
            hooks.beside(processes)
            keeper = 'graph' if way.one_process else first
            launched = time.monotonic() - began
            result = follow(
                scenario,
                entry.run,
                interrupted,
                show=hooks.show,
                ended=lambda: processes.ended() or intruders.found(),
                left=processes.left,
                stay=way.stay,
                interrupt=lambda: processes.interrupt(keeper),
                simulator=scenario.driver.label if scenario.driver else keeper,
                arguments=WITHOUT_LOG,
                folder=folder,
            )
        finally:
            failure = processes.stop()
    return replace(result, failure=failure or '', startup=launched + result.startup)


def shared_with_driver(scenario: Scenario) -> dict[str, Any]:
    """Return the parameters of a prepared scenario that its driver receives."""
    table = scenario.table(RunParameters)
    return {
        'control_period': table.control_period,
        'sync': table.sync,
        'answers': list(table.answers),
        'listeners': list(table.listeners),
    }


def _arguments(scenario: Scenario, parameters: Path | None) -> list[str]:
    """Return the arguments of a driver: parameters of the scenario, and a file of its own."""
    given = shared_with_driver(scenario).items()
    own = ['--params-file', str(parameters)] if parameters else []
    return [
        '--ros-args',
        *(word for name, value in given for word in ('-p', f'{name}:={json.dumps(value)}')),
        *own,
    ]


def _check_memory() -> None:
    """Refuse a limit under which the middleware's threads would be killed at some time."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
        raise RunError(
            f'ulimit -v: {limit // 1024} kB of address space is too small; accepted: at least '
            f'{LEAST_MEMORY // 1024} kB'
        )
