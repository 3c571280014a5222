"""Wait for the verdict of a launched run or round: ``ros2 run khr_bringup verdict FILE``."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from khr_analysis.outcome_values import labelled
from khr_analysis.referee import DRAW, Decision
from khr_bringup.bout.bout import is_bout, parse_bout
from khr_bringup.bout.recorded import folder_of_round
from khr_bringup.bout.result import BoutResult, write_bout
from khr_bringup.graph.following import Callbacks, follow, interrupts
from khr_bringup.graph.wiring import WIRING, Robots, Wiring
from khr_bringup.result import NO_HASH, Result, write_outcome
from khr_bringup.running import robots_of, round_of
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.driver import driver_of
from khr_bringup.scenario.expectation import MEANING, Expectation, realtime_text
from khr_common import KhrError, RunError
from khr_common.arithmetic import enter
from khr_common.errors import INTERRUPTED
from khr_common.processes import end_with_parent
from khr_common.statuses import own_run
from khr_common.strict_yaml import read_file


def main() -> int:
    """Follow the run of this namespace, or the round; print verdict, quantities and hash.

    Returns:
        0 if the run was complete and met the expectation, if any, or the round was decided; 1 if
        not; 2 if an argument is not accepted; 130 if it was interrupted.
    """
    enter()
    end_with_parent()
    from rclpy.utilities import remove_ros_args  # once the arithmetic is in force

    parser = argparse.ArgumentParser('verdict', description='Wait for the verdict of a run.')
    parser.add_argument('parameters', type=Path, help='the scenario.yaml of the run or bout')
    parser.add_argument('--expect', default='', help=MEANING)
    parser.add_argument('--out', type=Path, help='folder in which to write outcome.json')
    parser.add_argument('--driver', default='', help="in the simulator's place")
    parser.add_argument('--name', help='of scenario or bout; that of the file by default')
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    try:
        return (_round if is_bout(str(options.parameters)) else _run)(options)
    except KeyboardInterrupt:
        return INTERRUPTED
    except KhrError as error:
        print(f'verdict: {error}', file=sys.stderr)
        return 1 if isinstance(error, RunError) else 2


def _run(options: argparse.Namespace) -> int:
    scenario = scenarios.load_scenario(str(options.parameters))
    scenario = replace(scenario, name=options.name or scenario.name)
    if options.driver:
        scenario = scenario.driven_by(driver_of(options.driver, '--driver'))
    expected = Expectation.parse(options.expect, '--expect', scenario)
    (result,) = _followed(Robots.alone(scenario), options.parameters.parent)
    print(f'{scenario.name}: {result.verdict or "no verdict"}, ended by {result.end}')
    for label, text in labelled(result.judged).items():
        print(f'{label}: {text}')
    if result.realtime:
        print(f'real time {realtime_text(result.realtime)}')
    _print_end(result.warnings, result.trajectory_hash or NO_HASH)
    if options.out:
        write_outcome(options.out, result)
    if result.end == 'stopped':
        return INTERRUPTED
    unmet = expected.unmet(result.verdict, result.realtime)
    if unmet:
        print(f'verdict: {unmet}', file=sys.stderr)
    return 1 if unmet else 0


def _round(options: argparse.Namespace) -> int:
    file, folder = options.parameters, options.parameters.parent
    bout = parse_bout(read_file(file), str(file), options.name or folder.name)
    robots = robots_of(bout, 0)
    results = _followed(robots, folder_of_round(folder, 0))
    ended = round_of(dict(zip(robots.scenarios, results, strict=True)), 0)
    write_bout(folder, BoutResult(bout, [ended]))
    print(f'{bout.name}: {text_of(ended.decision)}')
    _print_end(ended.warnings, ended.trajectory_hash)
    return 0


def _followed(robots: Robots, folder: Path) -> list[Result]:
    """Follow a run to its end; its folder holds the wiring."""
    wiring = Wiring.read(folder / WIRING)
    with interrupts() as interrupted:
        callbacks = Callbacks(finish=lambda: bool(interrupted))
        return follow(robots, wiring.listeners, own_run(), callbacks, arguments=sys.argv)


def text_of(decision: Decision) -> str:
    """Return a decision as one line: winner, reason and time in s."""
    won = DRAW if decision.winner == DRAW else f'won by {decision.winner}'
    return f'{won}, {decision.reason}, {decision.time:.2f} s'


def _print_end(warnings: Sequence[str], trajectory_hash: str) -> None:
    for warning in warnings:
        print(f'warning: {warning}')
    print(f'trajectory hash {trajectory_hash}', flush=True)


if __name__ == '__main__':
    raise SystemExit(main())
