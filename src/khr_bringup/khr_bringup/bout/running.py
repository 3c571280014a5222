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
from khr_bringup.graph.robots import Robots
from khr_bringup.graph.run_registry import RunEntry, registered
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
        rounds = _Rounds(bout, folder, options, callbacks, entry)
        result = fight(bout, rounds.run)
    write_bout(folder, result)
    return result


class _Rounds:
    """The rounds of a bout, one after the other in the domain of an entry."""

    def __init__(
        self, bout: Bout, folder: Path, options: RunOptions, callbacks: Callbacks, entry: RunEntry
    ) -> None:
        self._bout, self._folder, self._options = bout, folder, options
        self._callbacks, self._entry, self._before = callbacks, entry, 0.0

    def run(self, number: int) -> Round:
        """Run a round, from 0."""
        robots = robots_of(self._bout, number)
        folder = folder_of_round(self._folder, number)
        folder.mkdir(mode=0o700)
        results = run_graph(
            robots,
            folder,
            self._entry.next_run(self._bout.name, self._folder),
            self._options,
            replace(self._callbacks, progress=self._show),
            self._folder / SCENARIO,
        )
        self._before += results[0].time
        return round_of(dict(zip(robots.scenarios, results, strict=True)), number)

    def _show(self, progress: Progress) -> None:
        self._callbacks.progress(replace(progress, time=self._before + progress.time))


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
    return Round(first.decision, outcomes, first.trajectory_hash, first.wall_time, first.warnings)
