"""Run a bout in the ROS graph: each round is a run of its own, in one domain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from khr_analysis.outcome import Outcome
from khr_analysis.referee import RED
from khr_bringup.bout.bout import Bout
from khr_bringup.bout.recorded import folder_of_round, record_bout, write_scenario
from khr_bringup.bout.result import BoutResult, Round, fight, write_bout
from khr_bringup.graph.following import Callbacks
from khr_bringup.graph.graph import RunOptions, run_graph
from khr_bringup.graph.run_registry import registered
from khr_bringup.graph.wiring import Robots
from khr_bringup.result import Progress, Result
from khr_bringup.run_folder import SCENARIO
from khr_common import RunError


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
