"""Wait for the end of a launched round: ``ros2 run khr_bringup bout_verdict FOLDER``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from khr_analysis.referee import DRAW, Decision
from khr_bringup.bout.bout import parse_bout
from khr_bringup.bout.recorded import folder_of_round
from khr_bringup.bout.result import BoutResult, write_bout
from khr_bringup.bout.running import robots_of, round_of
from khr_bringup.graph.following import Callbacks, follow, interrupts
from khr_bringup.graph.wiring import WIRING, Wiring
from khr_bringup.run_folder import SCENARIO
from khr_common import KhrError, RunError
from khr_common.arithmetic import enter
from khr_common.errors import INTERRUPTED
from khr_common.lifeline import end_with_parent
from khr_common.run_identity import own_run
from khr_common.text.strict_yaml import read_file


def main() -> int:
    """Follow the round; print winner, reason and trajectory hash, and write ``bout.json``.

    Returns:
        0 if the round was decided; 1 if not; 2 if an argument is not accepted; 130 if it was
        interrupted.
    """
    enter()
    end_with_parent()
    from rclpy.utilities import remove_ros_args  # once the arithmetic is in force

    parser = argparse.ArgumentParser('bout_verdict', description='Wait for the end of a round.')
    parser.add_argument('folder', type=Path, help='of the bout')
    parser.add_argument('--name', help='of the bout; that of the folder by default')
    options = parser.parse_args(remove_ros_args(sys.argv)[1:])
    folder = options.folder
    try:
        file = folder / SCENARIO
        bout = parse_bout(read_file(file), str(file), options.name or folder.name)
        robots = robots_of(bout, 0)
        wiring = Wiring.read(folder_of_round(folder, 0) / WIRING)
        with interrupts() as interrupted:
            callbacks = Callbacks(finish=lambda: bool(interrupted))
            results = follow(robots, wiring.listeners, own_run(), callbacks, arguments=sys.argv)
        ended = round_of(dict(zip(robots.scenarios, results, strict=True)), 0)
    except KeyboardInterrupt:
        return INTERRUPTED
    except KhrError as error:
        print(f'bout_verdict: {error}', file=sys.stderr)
        return 1 if isinstance(error, RunError) else 2
    write_bout(folder, BoutResult(bout, [ended]))
    print(f'{bout.name}: {text_of(ended.decision)}')
    for warning in ended.warnings:
        print(f'warning: {warning}')
    print(f'trajectory hash {ended.trajectory_hash}', flush=True)
    return 0


def text_of(decision: Decision) -> str:
    """Return a decision as one line: winner, reason and time in s."""
    won = DRAW if decision.winner == DRAW else f'won by {decision.winner}'
    return f'{won}, {decision.reason}, {decision.time:.2f} s'


if __name__ == '__main__':
    raise SystemExit(main())
