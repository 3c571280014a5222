"""Follow a run from its first instant to its verdict, from whatever process."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from khr_analysis.node_specs import RECORDER
from khr_bringup.node_registry import spec_of
from khr_bringup.scenario import Scenario
from khr_common import RunError
from khr_common.files import write_text
from khr_common.interfaces import DIAGNOSTICS, JOINT_STATE, READY, TF, TF_STATIC
from khr_sim.punctuality import FIGURES
from khr_sim.run_parameters import RunParameters

# s of wall time for nodes to appear, and for listeners to acknowledge the end: a loaded machine
# is slow, not broken.
PATIENCE = 30.0
SILENCE = 15.0  # s of wall time without a report of the simulator; it sends one every second
LAST_WORDS = 4.0  # s of wall time for the outcome of a run that was interrupted; launch waits 5


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
        warnings: what nodes complained of in diagnostics.
        failure: which process did not end well after the run; empty if all did.
        realtime: how it kept to the wall clock, as texts by name; empty in lockstep.
        scenario: that the graph was switched to; None if it was not.
    """

    verdict: str
    outcome: dict[str, str]
    trajectory_hash: str
    end: str
    started: float
    ended: float
    warnings: tuple[str, ...]
    failure: str = ''
    realtime: Mapping[str, str] = field(default_factory=dict)
    scenario: Scenario | None = None


def nodes_of(scenario: Scenario, record: bool) -> list[str]:
    """Return the nodes that a run of a scenario needs."""
    return [node for node in scenario.nodes if record or node != RECORDER.name]


def follow(
    scenario: Scenario,
    run: str,
    interrupted: Sequence[int],
    *,
    show: Callable[[Any], None] = lambda _: None,
    ended: Callable[[], str | None] = lambda: None,
    left: Callable[[], list[str]] = list,
    stay: bool = False,
    interrupt: Callable[[], None] = lambda: None,
    simulator: str = 'simulator',
    arguments: Sequence[str] = (),
) -> GraphResult:
    """Follow a run until it is over, received by all and judged.

    Args:
        scenario: as the nodes have it, from :func:`khr_bringup.graph.prepare`.
        run: its identity.
        interrupted: the signals that were caught so far.
        show: called some times a second with the :class:`~khr_bringup.run_monitor.View`.
        ended: describes a process of the run that has ended, if one has.
        left: describes processes beside the run that have ended since it was asked last.
        stay: whether to go on after the end of the run, until a signal.
        interrupt: called once, at the first signal.
        simulator: the process that has the simulator.
        arguments: of ROS, such as the namespace.

    Raises:
        RunError: if a node has ended, or does not appear or answer in time; it is named.
    """
    import rclpy
    from rclpy.experimental.events_executor import EventsExecutor
    from rclpy.signals import SignalHandlerOptions

    from khr_bringup.run_monitor import Watcher

    rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    table = scenario.table(RunParameters)
    watcher = Watcher(_awaited(table), run, _owners(scenario, table))
    executor = EventsExecutor()
    executor.add_node(watcher)
    view, deadline = watcher.view, float('inf')
    try:
        while (not view.over or (stay and not interrupted)) and time.monotonic() < deadline:
            executor.spin_once(0.1)
            view.warnings += left()
            show(view)
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
    return _result(view)


def _result(view: Any) -> GraphResult:
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
        realtime={name: values[name] for name in FIGURES if values.keys() >= set(FIGURES)},
        scenario=view.scenario,
    )


def _owners(scenario: Scenario, table: RunParameters) -> dict[str, str]:
    """Return the owner of each topic on which nobody else may publish.

    Left out is what has several sources, and what carries the run's identity in every message.
    """
    return {
        topic.name: node
        for node in nodes_of(scenario, RECORDER.name in table.listeners)
        for topic in spec_of(node).publishes
        if topic not in (DIAGNOSTICS, READY, TF, TF_STATIC) and topic.kind != JOINT_STATE
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
def interrupts() -> Iterator[list[int]]:
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


def write_outcome(
    folder: Path, scenario: str, verdict: str, quantities: dict[str, str], **more: object
) -> None:
    """Write ``outcome.json`` of a run.

    Raises:
        KhrError: if it cannot be written.
    """
    outcome = {'scenario': scenario, 'verdict': verdict, **quantities, **more}
    write_text(folder / 'outcome.json', json.dumps(outcome, indent=2) + '\n')
