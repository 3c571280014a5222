"""Time sweeps: two workers against one, a worker against the same runs in place, the engines.

``python -m tests.benchmarks.bench_sweeps [--repeats N]``
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import yaml

from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from tests.benchmarks.clock import Numbers, log

SCENARIO, SECONDS = 'walk_0deg', 10.0
FEW, MANY = 4, 20  # runs; between them a sweep's start cancels
ONE, TWO, MUJOCO = '1 worker', '2 workers', '2 workers, MuJoCo'
PLACE = 'in place'
KHR = [sys.executable, '-m', 'khr.cli.command', 'sweep']


def changes(engine: str) -> dict[str, Any]:
    """Return what all runs change of the scenario."""
    return {'simulator.engine': engine, 'simulator.duration': SECONDS}


def sweep(workers: int, runs: int, engine: str) -> float:
    """Return the wall time of a sweep over so many seeds, s."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / 'bench.yaml'
        file.write_text(
            yaml.safe_dump(
                {
                    'scenario': SCENARIO,
                    'set': changes(engine) | {'simulator.initial_tilt_deg': 0.3},
                    'seeds': runs,
                    'grid': {'simulator.inclination_deg': [0.0]},
                }
            )
        )
        began = time.perf_counter()
        subprocess.run(
            [*KHR, file, '--workers', str(workers), '--out', Path(folder) / 'out'],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        return time.perf_counter() - began


def in_place(runs: int) -> float:
    """Return the wall time of so many runs one after another in this process, s."""
    base = scenarios.load_scenario(SCENARIO).changed(
        {tuple(key.split('.')): value for key, value in changes('bullet').items()}
    )
    run_offline(base)  # what is loaded and compiled once
    began = time.perf_counter()
    for seed in range(runs):
        run_offline(
            base.changed({('simulator', 'seed'): seed, ('simulator', 'initial_tilt_deg'): 0.3})
        )
    return time.perf_counter() - began


def measure() -> Numbers:
    """Return the wall time of a run in each case, s, and the start of a sweep."""
    found: Numbers = {PLACE: in_place(MANY) / MANY}
    for name, workers, engine in ((ONE, 1, 'bullet'), (TWO, 2, 'bullet'), (MUJOCO, 2, 'mujoco')):
        log(f'sweep: {name}')
        few, many = (sweep(workers, runs, engine) for runs in (FEW, MANY))
        found[name] = (many - few) / (MANY - FEW)
        found[f'start, {name}'] = few - FEW * found[name]
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=3, help='rounds of all cases')
    for _ in range(parser.parse_args().repeats):
        print(measure())


if __name__ == '__main__':
    main()
