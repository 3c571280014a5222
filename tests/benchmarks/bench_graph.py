"""Time the graph against the physics alone: real-time factor, latency, start-up, memory.

``python -m tests.benchmarks.bench_graph [--repeats N]``
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import psutil

from khr_bringup.offline import ControlLoop, run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.scenario import Scenario
from khr_sim.physics.engines import bullet as engine
from khr_sim.physics.engines.bullet import bullet
from khr_sim.physics.truth import Truth
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from tests.benchmarks.clock import FACTORS, Numbers, clocks, factors, log
from tests.support.runs import Bag, children

SCENARIO = 'walk_0deg'
SECONDS = 6.0  # simulated
SHORT = scenarios.load_scenario(SCENARIO).changed({('simulator', 'duration'): SECONDS})
SECOND_ENGINE = SHORT.changed({('simulator', 'engine'): 'mujoco'})
REPEATS = 3
KHR = [sys.executable, '-m', 'khr.cli.command', 'run']


@cache
def twin_torques() -> tuple[list[int], list[list[float]], list[float]]:
    """Return the twin's joints, its torques on them in every step, and where they end, rad."""
    joints, torques, positions = [], [], []
    real = engine.bullet

    def motors(*arguments: object, **options: object) -> None:
        if arguments[2] == real.TORQUE_CONTROL:
            joints[:] = arguments[1]
            torques.append(options['forces'])
        real.setJointMotorControlArray(*arguments, **options)

    engine.bullet = SimpleNamespace(**{**vars(real), 'setJointMotorControlArray': motors})
    try:
        run_offline(SHORT, lambda truth, *_: positions.append(truth.joint_position.tolist()))
    finally:
        engine.bullet = real
    return joints, torques, positions[-1]


def plain(motors: bool = False) -> Numbers:
    """Return the real-time factor of a plain PyBullet loop: set all joints, step, read them.

    It does nothing else: no torso, no servo, no board, no sensor, no control. The world, the robot
    and its start are the twin's. Without the engine's motors it sets the torques that the twin
    reckoned, so that its motion and contacts are the twin's, which it checks; with them it holds
    the joints where they stand.
    """
    joints, torques, end = twin_torques()
    plant = Plant(SHORT.table(RunParameters))
    plant.start(ControlLoop(SHORT).reference(0.0))
    body, client = plant.world.engine.body, plant.world.engine.client
    held = [bullet.getJointState(body, i, client)[0] for i in joints]
    control, key = (
        (bullet.POSITION_CONTROL, 'targetPositions')
        if motors
        else (bullet.TORQUE_CONTROL, 'forces')
    )
    began = clocks()
    for torque in torques:
        bullet.setJointMotorControlArray(
            body, joints, control, physicsClientId=client, **{key: held if motors else torque}
        )
        bullet.stepSimulation(client)
        states = bullet.getJointStates(body, joints, client)
    figures = factors(len(torques) * plant.parameters.physics_step, began)
    plant.close()
    assert motors or [state[0] for state in states] == end
    return figures


def steps() -> Numbers:
    """Return the real-time factor of the twin's physics steps alone.

    That is servos, engine, contacts and joint states of every step, and nothing of what the twin
    does once in a control period.
    """
    spent = [0.0, 0.0]
    run = engine.Bullet.run

    def timed(*arguments: Any) -> list[float]:
        began = clocks()
        torques = run(*arguments)
        spent[:] = (
            so_far + now - then for so_far, now, then in zip(spent, clocks(), began, strict=True)
        )
        return torques

    with patch.object(engine.Bullet, 'run', timed):
        simulated = run_offline(SHORT).time
    return {clock: simulated / took for clock, took in zip(FACTORS, spent, strict=True)}


def offline(scenario: Scenario = SHORT) -> Numbers:
    """Return the real-time factor of the offline twin, from its first instant on."""
    began = (0.0, 0.0)

    def watch(truth: Truth, *_: object) -> None:
        nonlocal began
        if truth.step == 0:
            began = clocks()

    return factors(run_offline(scenario, watch).time, began)


def graph(*options: str) -> Numbers:
    """Return real-time factor, start-up and memory of a graph run."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / 'run'
        memory = run_khr(SCENARIO, SECONDS, out, *options)
        outcome = json.loads((out / 'outcome.json').read_text())
        result = {
            'factor': outcome['real_time_factor'],
            'startup_s': outcome['startup_s'],
            **{f'MiB {name}': max(sizes) for name, sizes in sorted(memory.items())},
        }
        if (out / 'bag').exists():
            result |= bag_figures(out / 'bag')
        return result


def run_khr(scenario: str, seconds: float, out: Path, *options: str) -> dict[str, list[float]]:
    """Run khr; return the memory of each of its processes over wall time, MiB (their own)."""
    process = subprocess.Popen(
        [*KHR, scenario, '--duration', str(seconds), *options, '--out', str(out)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    memory: dict[str, list[float]] = {}
    while process.poll() is None:
        with suppress(psutil.Error):
            for name, child in children(process).items():
                memory.setdefault(name, []).append(child.memory_full_info().uss / 2**20)
        time.sleep(0.5)  # a sample
    return memory


def bag_figures(folder: Path) -> Numbers:
    """Return messages per topic against instants, and the simulator's own latency figures."""
    bag = Bag(folder)
    instants = {message.clock.sec * 10**9 + message.clock.nanosec for _, message in bag['/clock']}
    lost = sum(
        len(instants) - len(messages)
        for topic, messages in bag.items()
        if topic.startswith(('/ground_truth', '/imu', '/foot_force', '/joint'))
    )
    latest = {
        pair.key: pair.value
        for _, array in bag['/diagnostics']
        for status in array.status
        if status.name == 'simulator'
        for pair in status.values
    }
    return {
        'messages': sum(map(len, bag.values())),
        'lost': lost,
        **{
            key: float(latest[key])
            for key in ('latency_p50_ms', 'latency_p99_ms')
            if latest.get(key)
        },
    }


RAW, MOTORS, TWIN = 'plain loop', "plain loop, engine's motors", 'offline twin'
STEPS = "the twin's steps alone"
MUJOCO_TWIN = 'offline twin, MuJoCo'
ONE, ONE_RECORDED = 'one process', 'one process, recorded'
EACH, EACH_RECORDED = 'a process per node', 'a process per node, recorded'
CASES: dict[str, Callable[[], Numbers]] = {
    RAW: plain,
    STEPS: steps,
    MOTORS: lambda: plain(motors=True),
    TWIN: offline,
    MUJOCO_TWIN: lambda: offline(SECOND_ENGINE),
    ONE: lambda: graph('--one-process', '--no-record'),
    ONE_RECORDED: lambda: graph('--one-process'),
    EACH: lambda: graph('--processes', '--no-record'),
    EACH_RECORDED: lambda: graph('--processes'),
    'one process, realtime': lambda: graph('--one-process', '--realtime'),
    'a process per node, realtime': lambda: graph('--processes', '--realtime'),
}


def measure(repeats: int) -> dict[str, list[Numbers]]:
    """Run every case in each of so many rounds."""
    runs: dict[str, list[Numbers]] = {name: [] for name in CASES}
    for number in range(repeats):
        for name, case in CASES.items():
            log(f'round {number + 1} of {repeats}: {name}')
            runs[name].append(case())
    return runs


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=REPEATS, help='rounds of all cases')
    for name, runs in measure(parser.parse_args().repeats).items():
        print(name, *({key: round(value, 2) for key, value in run.items()} for run in runs))


if __name__ == '__main__':
    main()
