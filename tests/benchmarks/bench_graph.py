"""Time the graph against the physics alone, in one run: ratios, latency, start-up, memory.

``python -m tests.benchmarks.bench_graph [--repeats N] [--json FILE] [--write FILE]``

Times on a shared machine are noisy. Every round runs every case, and the ratios within a round
are what counts.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from types import SimpleNamespace

import psutil

import khr_sim.world
from khr_bringup import scenario as scenarios
from khr_bringup.offline import Controllers, run_offline
from khr_sim.engine import bullet
from khr_sim.plant import Plant

SCENARIO = 'walk_0deg'
SECONDS = 6.0  # simulated
REPEATS = 3
STANDING = 300.0  # s simulated, over which memory may grow
WINDOW = 0.3, 0.9  # share of the standing between which growth counts: settled, not yet closing
KHR = [sys.executable, '-m', 'khr_bringup.command', 'run']

Figures = dict[str, float]


def steps_of_the_run() -> float:
    """Return simulated by wall time of the physics steps of an offline run, without the rest."""
    spent = 0.0
    real = khr_sim.world.bullet

    def step(client: int) -> None:
        nonlocal spent
        start = time.perf_counter()
        real.stepSimulation(client)
        spent += time.perf_counter() - start

    khr_sim.world.bullet = SimpleNamespace(**{**vars(real), 'stepSimulation': step})
    scenario = scenarios.load(SCENARIO).changed({('simulator', 'duration'): SECONDS})
    try:
        result = run_offline(scenario)
    finally:
        khr_sim.world.bullet = real
    return result.time / spent


def held() -> float:
    """Return simulated by wall time of stepSimulation alone, the robot held by the engine."""
    scenario = scenarios.load(SCENARIO)
    plant = Plant(scenario.table('simulator'))
    plant.start(Controllers(scenario).reference(0.0))
    world = plant.world
    joints = [i for i in range(bullet.getNumJoints(world.body, world.client))
              if bullet.getJointInfo(world.body, i, world.client)[2] == bullet.JOINT_REVOLUTE]
    held = [bullet.getJointState(world.body, i, world.client)[0] for i in joints]
    bullet.setJointMotorControlArray(world.body, joints, bullet.POSITION_CONTROL,
                                     targetPositions=held, physicsClientId=world.client)
    steps = round(SECONDS / plant.parameters.physics_step)
    start = time.perf_counter()
    for _ in range(steps):
        bullet.stepSimulation(world.client)
    factor = SECONDS / (time.perf_counter() - start)
    world.close()
    return factor


def offline() -> float:
    """Return the real-time factor of the offline twin."""
    scenario = scenarios.load(SCENARIO).changed({('simulator', 'duration'): SECONDS})
    began = [0.0]

    def watch(truth: object, _: object) -> None:
        if truth.step == 0:
            began[0] = time.perf_counter()
    result = run_offline(scenario, watch)
    return result.time / (time.perf_counter() - began[0])


def graph(*options: str) -> Figures:
    """Return real-time factor, start-up and memory of a graph run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / 'run'
        memory = run_khr(SCENARIO, SECONDS, out, *options)
        outcome = json.loads((out / 'outcome.json').read_text())
        result = {'factor': outcome['real_time_factor'], 'startup_s': outcome['startup_s'],
                  **{f'MiB {name}': max(sizes) for name, sizes in sorted(memory.items())}}
        if (out / 'bag').exists():
            result |= bag_figures(out / 'bag')
        return result


def run_khr(scenario: str, seconds: float, out: Path, *options: str) -> dict[str, list[float]]:
    """Run khr; return the memory of each of its processes over wall time, MiB (their own)."""
    process = subprocess.Popen(
        [*KHR, scenario, '--duration', str(seconds), *options, '--out', str(out)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    memory: dict[str, list[float]] = {}
    while process.poll() is None:
        for child in psutil.Process(process.pid).children():
            try:
                name = child.cmdline()[2].rsplit('.', 1)[-1]
                size = child.memory_full_info().uss / 2**20
            except (psutil.Error, IndexError):
                continue
            if size > 0.0:
                memory.setdefault(name, []).append(size)
        time.sleep(0.5)
    return memory


def growth() -> Figures:
    """Return by how many MiB each process grows in an hour of simulated standing."""
    with tempfile.TemporaryDirectory() as folder:
        memory = run_khr('stand_0deg', STANDING, Path(folder) / 'run', '--processes',
                         '--no-record')
    hours = (WINDOW[1] - WINDOW[0]) * STANDING / 3600.0
    return {name: (sizes[round(WINDOW[1] * len(sizes))] - sizes[round(WINDOW[0] * len(sizes))])
            / hours for name, sizes in sorted(memory.items())}


def bag_figures(folder: Path) -> Figures:
    """Return messages per topic against instants, and the simulator's own latency figures."""
    from tests.graph.conftest import read_bag
    bag = read_bag(folder)
    instants = {message.clock.sec * 10**9 + message.clock.nanosec
                for _, message in bag['/clock']}
    lost = sum(len(instants) - len(messages) for topic, messages in bag.items()
               if topic.startswith(('/ground_truth', '/imu', '/foot_force', '/joint')))
    latest = {pair.key: pair.value for _, array in bag['/diagnostics'] for status in array.status
              if status.name == 'simulator' for pair in status.values}
    return {'messages': sum(map(len, bag.values())), 'lost': lost,
            **{key: float(latest[key]) for key in ('latency_p50_ms', 'latency_p99_ms')
               if latest.get(key)}}


RAW, TWIN = 'physics steps of the run alone', 'offline twin'
CASES: dict[str, Callable[[], Figures]] = {
    RAW: lambda: {'factor': steps_of_the_run()},
    "physics steps, held by the engine's motors": lambda: {'factor': held()},
    TWIN: lambda: {'factor': offline()},
    'one process': lambda: graph('--one-process', '--no-record'),
    'one process, recorded': lambda: graph('--one-process'),
    'nine processes': lambda: graph('--processes', '--no-record'),
    'nine processes, recorded': lambda: graph('--processes'),
    'one process, realtime': lambda: graph('--one-process', '--realtime'),
    'nine processes, realtime': lambda: graph('--processes', '--realtime'),
}
AGAINST = [(TWIN, RAW, '90 %'), (TWIN, "physics steps, held by the engine's motors", '90 %'),
           ('one process', TWIN, '80 %'),
           ('one process, recorded', 'one process', '85 %'), ('nine processes', TWIN, '60 %'),
           ('nine processes, recorded', 'nine processes', '85 %')]


def measure(repeats: int) -> dict[str, list[Figures]]:
    """Run every case so often, a round of all at a time."""
    runs: dict[str, list[Figures]] = {name: [] for name in CASES}
    for _ in range(repeats):
        for name, case in CASES.items():
            runs[name].append(case())
    return runs


def report(runs: dict[str, list[Figures]], grown: Figures) -> str:
    """Return the figures as Markdown: ratios first, then what depends on the machine more."""
    lines = [
        '# Performance', '',
        f'Generated by `python -m tests.benchmarks.bench_graph --write docs/performance.md`: '
        f'`{SCENARIO}`, {SECONDS:g} simulated seconds, {len(runs[TWIN])} round(s) of all cases; '
        'physics step 1 ms, control period 15 ms. Steps per second of wall time as a ratio within '
        'a round, so that the machine and most of its load cancel; on a machine with other work '
        'the spread is wide.', '',
        '| steps per second of | against | goal | least | median | most |',
        '|---|---|---|---|---|---|']
    for name, base, goal in AGAINST:
        lines.append(f'| {name} | {base} | {goal} | ' + ' | '.join(
            f'{value:.0%}' for value in spread(
                mine['factor'] / other['factor'] for mine, other
                in zip(runs[name], runs[base], strict=True))) + ' |')
    lines += ['', 'Simulated by wall time, here and then:', '',
              '| case | least | median | most |', '|---|---|---|---|']
    lines += [f'| {name} | ' + ' | '.join(
        f'{value:.2f}' for value in spread(run['factor'] for run in each)) + ' |'
        for name, each in runs.items()]
    lines += ['', 'Medians of start-up (s), memory of each process of its own (MiB), messages in '
              'the bag, messages lost, and time from a sample to its correction (ms):', '']
    for name, each in runs.items():
        rest = {key: round(statistics.median(run[key] for run in each if key in run), 2)
                for key in each[0] if key != 'factor'}
        if rest:
            lines.append(f'- {name}: ' + ', '.join(f'{key} {value:g}'
                                                   for key, value in rest.items()))
    if grown:
        lines += ['', f'Growth of memory, MiB in an hour of simulated time, from {STANDING:g} '
                  's of standing: ' + ', '.join(f'{name} {each:+.1f}'
                                                for name, each in grown.items()) + '.']
    return '\n'.join(lines) + '\n'


def spread(values: Iterable[float]) -> tuple[float, float, float]:
    """Return least, median and most."""
    ordered = sorted(values)
    return ordered[0], statistics.median(ordered), ordered[-1]


def main() -> None:
    """Measure, print the report, write it and the raw figures where asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=REPEATS)
    parser.add_argument('--json', type=Path)
    parser.add_argument('--write', type=Path)
    options = parser.parse_args()
    runs, grown = measure(options.repeats), growth()
    text = report(runs, grown)
    print(text)
    if options.json:
        options.json.write_text(json.dumps({'runs': runs, 'growth': grown}, indent=2) + '\n')
    if options.write:
        options.write.write_text(text, encoding='utf-8')


if __name__ == '__main__':
    main()
