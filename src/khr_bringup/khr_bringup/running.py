"""A run of a scenario or a bout, as a graph or offline, from its folder to its result.

In a graph each round of a bout is a run of its own, in one domain.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from khr_analysis.outcome import Outcome
from khr_analysis.referee import RED
from khr_bringup.bout.bout import Bout
from khr_bringup.bout.recorded import folder_of_round, record_bout, write_scenario
from khr_bringup.bout.result import BoutResult, Round, fight, write_bout
from khr_bringup.code_version import as_run
from khr_bringup.graph.following import Callbacks
from khr_bringup.graph.graph import RunOptions, run_graph
from khr_bringup.graph.run_registry import RunEntry, registered
from khr_bringup.graph.wiring import Robots
from khr_bringup.offline import ControlLoop, Watch, run_offline
from khr_bringup.result import Progress, Result
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.scenario import Scenario
from khr_common import RunError
from khr_common.files import write_text
from khr_sim.physics.truth import GroundTruth


def run_to_end(
    scenario: Scenario,
    folder: Path,
    options: RunOptions,
    callbacks: Callbacks,
    session: RunEntry | None = None,
) -> Result:
    """Run a scenario to its end.

    Args:
        scenario: to run.
        folder: claimed for the run; it receives the scenario, and of a graph the recording and the
            logs of its processes.
        options: how to run it.
        callbacks: to call meanwhile.
        session: a registered entry with the ROS domain of the run; by default a new one.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if the run could not go on.
    """
    if options.offline:
        write_text(folder / SCENARIO, as_run(scenario))
        return run_offline(scenario, offline_progress(callbacks.progress))
    with (
        registered(scenario.name, folder, options.domain, options.network)
        if session is None
        else nullcontext(session.next_run(scenario.name, folder))
    ) as entry:
        callbacks.started(entry)
        (result,) = run_graph(Robots.alone(scenario), folder, entry, options, callbacks)
        return result


def offline_progress(show: Callable[[Progress], None]) -> Watch:
    """Return a callback that shows the progress of an offline run."""
    began = time.monotonic()

    def watch(truth: GroundTruth, loop: ControlLoop, _: object) -> None:
        seconds = truth.stamp_ns / 1e9
        factor = seconds / (time.monotonic() - began + 1e-9)
        show(Progress(seconds, 'offline', factor, loop.pitch_rate))

    return watch


def run_to_decision(
    bout: Bout, folder: Path, options: RunOptions, callbacks: Callbacks
) -> BoutResult:
    """Run a bout to its end; write its scenario, the bag of each round and ``bout.json``.

    Args:
        bout: to run.
        folder: claimed for it.
        options: how to run it.
        callbacks: to call meanwhile; the time of the progress is that of the whole bout.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if a round could not go on; a node of one robot is named with the robot.
        KeyboardInterrupt: if a signal has ended a round.
    """
    if options.offline:
        return record_bout(
            bout,
            folder,
            options.record,
            lambda time: callbacks.progress(Progress(time, 'offline')),
        )
    write_scenario(bout, folder)
    with registered(bout.name, folder, options.domain, options.network) as entry:
        callbacks.started(entry)

        def run_round(number: int, before: float) -> Round:
            def show(progress: Progress) -> None:
                callbacks.progress(replace(progress, time=before + progress.time))

            robots, own = robots_of(bout, number), folder_of_round(folder, number)
            own.mkdir(mode=0o700)
            results = run_graph(
                robots,
                own,
                entry.next_run(bout.name, folder),
                options,
                replace(callbacks, progress=show),
                folder / SCENARIO,
            )
            return round_of(dict(zip(robots.scenarios, results, strict=True)), number)

        result = fight(bout, run_round)
    write_bout(folder, result)
    return result


def robots_of(bout: Bout, number: int) -> Robots:
    """Return the robots of a round, from 0."""
    in_round = replace(bout, robots=bout.in_round(number))
    return Robots(in_round.robots, in_round.to_yaml(), bout.places)


def round_of(results: Mapping[str, Result], number: int) -> Round:
    """Return a round, from 0, of the results of its robots.

    Raises:
        RunError: if a process failed, or the referee did not decide it.
        KeyboardInterrupt: if it was interrupted.
    """
    first = results[RED]
    if first.failure:
        raise RunError(f'round {number + 1}: {first.failure}')
    if first.end == 'stopped':
        raise KeyboardInterrupt
    if first.decision is None:
        raise RunError(f'round {number + 1}: the referee did not decide it')
    outcomes: dict[str, Outcome] = {robot: each.outcome for robot, each in results.items()}
    return Round(
        first.decision,
        outcomes,
        first.trajectory_hash,
        first.time,
        first.wall_time,
        first.warnings,
    )
