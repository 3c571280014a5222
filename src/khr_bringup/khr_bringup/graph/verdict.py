"""Wait for the verdict of a run that others started: ``ros2 run khr_bringup verdict FILE``."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from khr_analysis.outcome_values import labelled
from khr_bringup.graph.following import Callbacks, follow, interrupts
from khr_bringup.graph.robots import Robots
from khr_bringup.graph.wiring import WIRING, Wiring
from khr_bringup.result import NO_HASH, Result, write_outcome
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.driver import driver_of
from khr_bringup.scenario.expectation import MEANING, Expectation, realtime_text
from khr_common import KhrError, RunError
from khr_common.arithmetic import enter
from khr_common.errors import INTERRUPTED
from khr_common.lifeline import end_with_parent
from khr_common.run_identity import own_run


def main() -> int:
    """Follow the run of this namespace; print verdict, quantities and trajectory hash.

    Returns:
        0 if the run was complete and met the expectation, if any; 1 if not; 2 if an
        argument is not accepted; 130 if it was interrupted.
    """
    enter()
    end_with_parent()
    from rclpy.utilities import remove_ros_args  # once the arithmetic is in force

    parser = argparse.ArgumentParser('verdict', description='Wait for the verdict of a run.')
    parser.add_argument('parameters', type=Path, help='the scenario.yaml of the run')
    parser.add_argument('--expect', default='', help=MEANING)
    parser.add_argument('--out', type=Path, help='folder in which to write outcome.json')
    parser.add_argument('--driver', default='', help="in the simulator's place")
    parser.add_argument('--name', help='of the scenario; that of the file by default')
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    try:
        scenario = scenarios.load_scenario(str(options.parameters))
        scenario = replace(scenario, name=options.name or scenario.name)
        if options.driver:
            scenario = scenario.driven_by(driver_of(options.driver, '--driver'))
        wiring = Wiring.read(options.parameters.with_name(WIRING))
        expected = Expectation.parse(options.expect, '--expect', scenario)
        with interrupts() as interrupted:
            callbacks = Callbacks(finish=lambda: bool(interrupted))
            (result,) = follow(
                Robots.alone(scenario), wiring.listeners, own_run(), callbacks, arguments=sys.argv
            )
        _show(result)
        if options.out:
            write_outcome(options.out, result)
    except KhrError as error:
        print(f'verdict: {error}', file=sys.stderr)
        return 1 if isinstance(error, RunError) else 2
    if result.end == 'stopped':
        return INTERRUPTED
    unmet = expected.unmet(result.verdict, result.realtime)
    if unmet:
        print(f'verdict: {unmet}', file=sys.stderr)
    return 1 if unmet else 0


def _show(result: Result) -> None:
    print(f'{result.scenario.name}: {result.verdict or "no verdict"}, ended by {result.end}')
    for label, text in labelled(result.judged).items():
        print(f'{label}: {text}')
    if result.realtime:
        print(f'real time {realtime_text(result.realtime)}')
    for warning in result.warnings:
        print(f'warning: {warning}')
    print(f'trajectory hash {result.trajectory_hash or NO_HASH}', flush=True)


if __name__ == '__main__':
    raise SystemExit(main())
