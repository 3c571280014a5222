"""Speed of the Gymnasium environment: alone, and one on each core through ``make_vec``."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import gymnasium
import numpy as np

import khr
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from tests.benchmarks.clock import WALL, clocks, log, speeds

SCENARIO, SECONDS = 'walk_0deg', 10.0
ENGINES = ('bullet', 'mujoco')
PERIOD = 0.015  # s
WARM_UP = 20  # steps before the clock starts
TWIN, ALONE, EACH = 'offline twin', 'environment', 'environment on each core, through make_vec'
APART = 'environment on each core, unknown to one another, by the longest of each step'


def measure():
    """Return the speed of each case on each engine, of one environment."""
    found = {}
    for engine in ENGINES:
        for case, run in ((TWIN, twin), (ALONE, alone), (APART, apart), (EACH, each)):
            log(f'environments: {case}, {engine}')
            found[f'{case}, {engine}'] = run(engine)
    return found


def twin(engine):
    """Return the speed of the offline twin."""
    began = []
    changes = {('simulator', 'engine'): engine, ('simulator', 'duration'): SECONDS}
    scenario = scenarios.load_scenario(SCENARIO).changed(changes)
    seconds = run_offline(scenario, lambda *_: began or began.append(clocks())).time
    return speeds(seconds, clocks() - began[0])


def alone(engine):
    """Return the speed of one environment."""
    times = step_times(engine)
    return speeds(SECONDS, times[-1] - times[0])


def step_times(engine, begin=lambda: None):
    """Return both clocks before the first step and after each, (n + 1, 2), s."""
    action = np.zeros(2, np.float32)
    with khr.env(SCENARIO, engine=engine) as environment:
        environment.reset(seed=0)
        for _ in range(WARM_UP):
            environment.step(action)
        begin()
        times = [clocks()]
        for _ in range(round(SECONDS / PERIOD)):
            environment.step(action)
            times.append(clocks())
    return np.array(times)


def apart(engine):
    """Return the speed of independent processes, one a core, by the slowest of them in each step.

    An action for all environments may depend on the observations of all.
    """
    cores, context = len(os.sched_getaffinity(0)), get_context('spawn')
    with context.Manager() as manager, ProcessPoolExecutor(cores, context) as pool:
        barrier = manager.Barrier(cores)
        runs = [pool.submit(step_times, engine, barrier.wait) for _ in range(cores)]
        times = np.array([run.result()[:, 0] for run in runs])
    return {WALL: SECONDS / float(np.diff(times).max(axis=0).sum())}


def each(engine):
    """Return the speed of the environments of ``make_vec``, as many as there are cores."""
    cores = len(os.sched_getaffinity(0))
    environments = gymnasium.make_vec(
        'khr.environment:khr/Walk-v0',
        cores,
        vectorization_mode='async',
        scenario=SCENARIO,
        engine=engine,
    )
    actions = np.zeros((cores, 2), np.float32)
    try:
        environments.reset(seed=0)
        for _ in range(WARM_UP):
            environments.step(actions)
        began = clocks()
        for _ in range(round(SECONDS / PERIOD)):
            environments.step(actions)
        return {WALL: speeds(SECONDS, clocks() - began)[WALL]}
    finally:
        environments.close()
