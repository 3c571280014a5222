"""Time the graph against a raw loop of the same world, in one run: ratios, latency, memory.

``python -m tests.benchmarks.bench_graph [OUT.json]``: a table, then JSON. Times on a shared
machine are noisy; the ratios within one run are what counts.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

from khr_bringup import scenario as scenarios
from khr_bringup.offline import Controllers, run_offline
from khr_sim.engine import bullet
from khr_sim.plant import Plant

SCENARIO = 'walk_0deg'
SECONDS = 6.0  # simulated
REPEATS = 3
KHR = [sys.executable, '-m', 'khr_bringup.command', 'run', SCENARIO, '--duration', str(SECONDS)]


def raw() -> float:
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


def graph(*options: str) -> dict[str, float]:
    """Return real-time factor, start-up and memory of a graph run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / 'run'
        process = subprocess.Popen([*KHR, *options, '--out', str(out)],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        memory: dict[str, float] = {}
        while process.poll() is None:
            for child in psutil.Process(process.pid).children():
                try:
                    name = child.cmdline()[2].rsplit('.', 1)[-1]
                    memory[name] = child.memory_full_info().pss / 2**20
                except (psutil.Error, IndexError):
                    continue
            time.sleep(0.5)
        outcome = json.loads((out / 'outcome.json').read_text())
        result = {'factor': outcome['real_time_factor'], 'startup_s': outcome['startup_s'],
                  **{f'MiB {name}': size for name, size in sorted(memory.items())}}
        if (out / 'bag').exists():
            result |= bag_figures(out / 'bag')
        return result


def bag_figures(folder: Path) -> dict[str, float]:
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


CASES = {
    'raw stepSimulation': lambda: {'factor': raw()},
    'offline': lambda: {'factor': offline()},
    'one process': lambda: graph('--one-process', '--no-record'),
    'one process, recorded': lambda: graph('--one-process'),
    'nine processes': lambda: graph('--processes', '--no-record'),
    'nine processes, recorded': lambda: graph('--processes'),
    'one process, realtime': lambda: graph('--one-process', '--realtime'),
    'nine processes, realtime': lambda: graph('--processes', '--realtime'),
}


def main() -> None:
    """Run every case REPEATS times, interleaved, and print medians with their spread."""
    runs: dict[str, list[dict[str, float]]] = {name: [] for name in CASES}
    for _ in range(REPEATS):
        for name, case in CASES.items():
            runs[name].append(case())
    factor = {name: sorted(run['factor'] for run in each) for name, each in runs.items()}
    base = statistics.median(factor['raw stepSimulation'])
    twin = statistics.median(factor['offline'])
    print(f'{"case":28} {"x real time (min, median, max)":32} {"of raw":>7} {"of offline":>10}')
    for name, each in factor.items():
        middle = statistics.median(each)
        spread = f'{each[0]:.2f}, {middle:.2f}, {each[-1]:.2f}'
        print(f'{name:28} {spread:32} {middle / base:7.0%} {middle / twin:10.0%}')
    for name, each in runs.items():
        rest = {key: round(statistics.median(run[key] for run in each if key in run), 2)
                for key in each[0] if key != 'factor'}
        if rest:
            print(f'{name}: ' + ', '.join(f'{key} {value}' for key, value in rest.items()))
    text = json.dumps(runs, indent=2)
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(text + '\n')
    else:
        print(text)


if __name__ == '__main__':
    main()
