"""Wall time of sweeps and of whole commands, and what an hour of standing costs."""

import os
import subprocess
import tempfile
import time
from pathlib import Path

import psutil
import yaml

from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_common import RunError
from tests import ROOT
from tests.benchmarks.clock import WALL, log
from tests.support.runs import KHR

SCENARIO, SECONDS = 'walk_0deg', 10.0
FEW, MANY = 4, 20  # runs; the start of a sweep cancels in the difference
ONE, TWO, MUJOCO = '1 worker', '2 workers', '2 workers, MuJoCo'
PLACE = 'in place'
TILT = {'simulator.initial_tilt_deg': 0.3}
# Goal in s of wall time on two cores, and the words, in this order in one folder: the first
# installs what the others use.
COMMANDS = {
    'make run': (60.0, ('make', '-C', 'clone', 'run')),
    'make test': (360.0, ('make', '-C', 'clone', 'test')),
    'make quick': (60.0, ('make', '-C', 'clone', 'quick')),
    'khr reproduce --fast --engine mujoco': (
        75.0, (*KHR, 'reproduce', '--fast', '--engine', 'mujoco', '--out', 'fast')),
    'khr reproduce --engine mujoco': (
        600.0, (*KHR, 'reproduce', '--engine', 'mujoco', '--out', 'all')),
}  # fmt: skip
ENDS = 10.0, 60.0, 600.0, 1800.0, 3600.0  # simulated s; costs are compared between them


def sweep(workers, runs, engine):
    """Return the wall time of a sweep over so many seeds, s."""
    changes = {'simulator.engine': engine, 'simulator.duration': SECONDS, **TILT}
    grid = {'simulator.inclination_deg': [0.0]}
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / 'bench.yaml'
        file.write_text(
            yaml.safe_dump({'scenario': SCENARIO, 'set': changes, 'seeds': runs, 'grid': grid})
        )
        command = [*KHR, 'sweep', file, '--workers', str(workers), '--out', Path(folder) / 'out']
        began = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        return time.perf_counter() - began


def in_place(runs):
    """Return the wall time of so many runs one after another in this process, s."""
    base = scenarios.load_scenario(SCENARIO).set_to([f'simulator.duration={SECONDS}'])
    run_offline(base)  # loads and compiles
    began = time.perf_counter()
    for seed in range(runs):
        run_offline(base.set_to([f'simulator.seed={seed}', 'simulator.initial_tilt_deg=0.3']))
    return time.perf_counter() - began


def sweeps():
    """Return the speed of a sweep's runs in each case, and the start of the workers, s."""
    found = {PLACE: {WALL: SECONDS * MANY / in_place(MANY)}}
    for name, workers, engine in ((ONE, 1, 'bullet'), (TWO, 2, 'bullet'), (MUJOCO, 2, 'mujoco')):
        log(f'sweeps: {name}')
        few, many = (sweep(workers, runs, engine) for runs in (FEW, MANY))
        run = (many - few) / (MANY - FEW)
        found[name] = {WALL: SECONDS / run, 'start_s': few - FEW * run}
    return found


def growth(engine, seconds=ENDS[-1]):
    """Return computing time per simulated second and memory in each part of a long standing."""
    log(f'growth: {seconds:g} s of standing on {engine}')
    scenario = scenarios.load_scenario('stand_0deg').set_to(
        [f'simulator.engine={engine}', f'simulator.duration={seconds}']
    )
    found, ends = [], [0.0, *(end for end in ENDS if end < seconds), seconds]
    last = (0.0, 0.0)

    def watch(truth, *_):
        nonlocal last
        now = truth.stamp_ns / 1e9
        if not ends or now < ends[0] - 1e-9:
            return
        ends.pop(0)
        computed = time.thread_time()
        if now > 0.0:
            cost = 1e3 * (computed - last[1]) / (now - last[0])
            memory = psutil.Process().memory_info().rss / 2**20
            found.append({'until_s': now, 'ms per simulated s': cost, 'MiB': memory})
        last = now, computed

    run_offline(scenario, watch)
    return found


def commands():
    """Return the wall time of each command, s; those of make in a clone of the last commit."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(['git', 'clone', '--quiet', ROOT, 'clone'], cwd=folder, check=True)
        cold = {'UV_CACHE_DIR': str(Path(folder) / 'cache'), 'PIP_NO_CACHE_DIR': '1'}
        for name, (_, words) in COMMANDS.items():
            log(name)
            output = Path(tempfile.gettempdir(), f'{name.replace(" ", "_")}.log')
            with output.open('w') as file:
                began = time.perf_counter()
                done = subprocess.run(
                    words, cwd=folder, env={**os.environ, **cold}, stdout=file, stderr=file,
                    check=False,
                )  # fmt: skip
                found[name] = time.perf_counter() - began
            if done.returncode:
                raise RunError(f'{name}: exit code {done.returncode}; its output is in {output}')
            output.unlink()
    return found
