"""What a simulated second costs from the first ten to the end of an hour: time and memory.

``python -m tests.benchmarks.bench_growth [--seconds S]``
"""

from __future__ import annotations

import argparse
import time

import psutil

from khr_analysis.outcome import Outcome
from khr_bringup.offline import ControlLoop, run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_sim.physics.truth import Truth
from tests.benchmarks.clock import Numbers, log

PARTS = 0.0, 10.0, 60.0, 600.0, 1800.0, 3600.0  # simulated s; costs are compared between them


def measure(engine: str, seconds: float = PARTS[-1]) -> list[Numbers]:
    """Return, for each part of a long standing, computing time per simulated s, and MiB."""
    log(f'growth: {seconds:g} s of standing on {engine}')
    scenario = scenarios.load_scenario('stand_0deg').changed(
        {('simulator', 'engine'): engine, ('simulator', 'duration'): seconds}
    )
    found: list[Numbers] = []
    marks = iter([*(part for part in PARTS if part < seconds), seconds])
    due, last, process = next(marks), (0.0, 0.0), psutil.Process()

    def watch(truth: Truth, _loop: ControlLoop, _outcome: Outcome) -> None:
        nonlocal due, last
        now = truth.stamp_ns / 1e9
        if now < due - 1e-9:
            return
        computed = time.thread_time()
        if now > 0.0:
            found.append(
                {
                    'until_s': now,
                    'ms per simulated s': 1e3 * (computed - last[1]) / (now - last[0]),
                    'MiB': process.memory_info().rss / 2**20,
                }
            )
        last, due = (now, computed), next(marks, float('inf'))

    run_offline(scenario, watch)
    return found


def main() -> None:
    """Measure both engines and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=PARTS[-1], help='simulated')
    seconds = parser.parse_args().seconds
    for engine in ('bullet', 'mujoco'):
        for part in measure(engine, seconds):
            print(engine, {key: round(value, 2) for key, value in part.items()})


if __name__ == '__main__':
    main()
