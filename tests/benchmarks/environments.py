"""Speed of the Gymnasium environment: alone, and one on each core through ``make_vec``."""

import os
from contextlib import closing

import gymnasium
import numpy as np

import khr
from khr_bringup.scenario import scenario as scenarios
from tests.benchmarks.clock import WALL, clocks, log, speeds
from tests.benchmarks.graphs import offline

SCENARIO, SECONDS = 'walk_0deg', 10.0
ENGINES = ('bullet', 'mujoco')
PERIOD = 0.015  # s
WARM_UP = 20  # steps before the clock starts
TWIN, ALONE, EACH = 'offline twin', 'environment', 'environment on each core, through make_vec'


def measure():
    """Return the speed of each case on each engine, of one environment."""
    found = {}
    for engine in ENGINES:
        for case, run in ((TWIN, twin), (ALONE, alone), (EACH, each)):
            log(f'environments: {case}, {engine}')
            found[f'{case}, {engine}'] = run(engine)
    return found


def twin(engine):
    """Return the speed of the offline twin."""
    changes = {('simulator', 'engine'): engine, ('simulator', 'duration'): SECONDS}
    return offline(scenarios.load_scenario(SCENARIO).changed(changes))


def alone(engine):
    """Return the speed of one environment."""
    with khr.env(SCENARIO, engine=engine) as environment:
        return stepped(environment, np.zeros(2, np.float32))


def stepped(environment, action):
    """Return the speed of an environment that takes the same action in each step."""
    environment.reset(seed=0)
    for _ in range(WARM_UP):
        environment.step(action)
    began = clocks()
    for _ in range(round(SECONDS / PERIOD)):
        environment.step(action)
    return speeds(SECONDS, clocks() - began)


def each(engine):
    """Return the speed of the environments of ``make_vec``, as many as there are cores."""
    cores = len(os.sched_getaffinity(0))
    options = {'vectorization_mode': 'async', 'scenario': SCENARIO, 'engine': engine}
    with closing(gymnasium.make_vec('khr.environment:khr/Walk-v0', cores, **options)) as each:
        return {WALL: stepped(each, np.zeros((cores, 2), np.float32))[WALL]}
