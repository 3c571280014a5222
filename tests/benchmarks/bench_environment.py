"""Time the Gymnasium environment: against the twin, and one on each core through ``make_vec``.

``python -m tests.benchmarks.bench_environment``
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import gymnasium
import numpy as np

import khr
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_common.maths.rotation import Array
from tests.benchmarks.clock import FACTORS, WALL, Numbers, clocks, factors, log

SCENARIO, SECONDS = 'walk_0deg', 10.0
ENGINES = ('bullet', 'mujoco')
PERIOD = 0.015  # s
STEPS = round(SECONDS / PERIOD)
BEGUN = 20  # steps before the clock starts
TWIN, ALONE, EACH = 'offline twin', 'environment', 'environment on each core, through make_vec'
APART = 'environment on each core, unknown to one another, by the longest of each step'


def named(case: str, engine: str) -> str:
    """Return the name of a case on an engine."""
    return f'{case}, {engine}'


def measure() -> dict[str, Numbers]:
    """Return simulated time by wall and by computing time of each case, of one environment."""
    found = {}
    for engine in ENGINES:
        log(f'environment: {engine}')
        found |= {
            named(TWIN, engine): _twin(engine),
            named(ALONE, engine): _alone(engine),
            named(APART, engine): _apart(engine),
            named(EACH, engine): _each(engine),
        }
    return found


def _twin(engine: str) -> Numbers:
    began: list[tuple[float, float]] = []
    changes = {('simulator', 'engine'): engine, ('simulator', 'duration'): SECONDS}
    seconds = run_offline(
        scenarios.load_scenario(SCENARIO).changed(changes),
        lambda *_: began or began.append(clocks()),
    ).time
    return factors(seconds, began[0])


def _alone(engine: str) -> Numbers:
    moments = _moments(engine)
    return dict(zip(FACTORS, SECONDS / (moments[-1] - moments[0]), strict=True))


def _moments(engine: str, begin: Callable[[], object] = lambda: None) -> Array:
    """Return both clocks before the first step and after each, (n + 1, 2), s."""
    still = np.zeros(2, np.float32)
    with khr.env(SCENARIO, engine=engine) as environment:
        environment.reset(seed=0)
        for _ in range(BEGUN):
            environment.step(still)
        begin()
        moments = [clocks()]
        for _ in range(STEPS):
            environment.step(still)
            moments.append(clocks())
    return np.array(moments)


def _apart(engine: str) -> Numbers:
    """Return simulated by wall time of as many processes as there are cores.

    Of each step the longest counts: an action for all may depend on what all have observed.
    """
    cores, context = len(os.sched_getaffinity(0)), get_context('spawn')
    with context.Manager() as manager:
        together = manager.Barrier(cores)
        with ProcessPoolExecutor(cores, context) as pool:
            runs = [pool.submit(_moments, engine, together.wait) for _ in range(cores)]
            walls = np.array([run.result()[:, 0] for run in runs])
    return {WALL: SECONDS / np.diff(walls).max(axis=0).sum()}


def _each(engine: str) -> Numbers:
    """Return simulated by wall time of each of as many environments as there are cores.

    They are what ``make_vec`` makes by default: ``khr.vector_env``.
    """
    cores = len(os.sched_getaffinity(0))
    environments = gymnasium.make_vec('khr/Walk-v0', cores, scenario=SCENARIO, engine=engine)
    still = np.zeros((cores, 2), np.float32)
    try:
        environments.reset(seed=0)
        for _ in range(BEGUN):
            environments.step(still)
        began = clocks()
        for _ in range(STEPS):
            environments.step(still)
        return {WALL: factors(SECONDS, began)[WALL]}
    finally:
        environments.close()


def main() -> None:
    """Measure once and print."""
    for case, found in measure().items():
        speeds = ', '.join(f'{found[clock]:.1f} ({clock})' for clock in found)
        print(f'{case:50}{speeds}')


if __name__ == '__main__':
    main()
