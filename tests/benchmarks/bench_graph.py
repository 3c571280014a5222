"""Time the graph against the physics alone, in one run: ratios, latency, start-up, memory.

``python -m tests.benchmarks.bench_graph [--repeats N] [--standing S] [--write FILE]
[--read FILE]``

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
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import psutil

from khr_bringup import scenario as scenarios
from khr_bringup.offline import ControlLoop, run_offline
from khr_bringup.scenario import Scenario
from khr_common.files import write_text
from khr_sim.engines import bullet as engine
from khr_sim.engines.bullet import bullet
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from khr_sim.truth import Truth

SCENARIO = 'walk_0deg'
SECONDS = 6.0  # simulated
SHORT = scenarios.load(SCENARIO).changed({('simulator', 'duration'): SECONDS})
SECOND_ENGINE = SHORT.changed({('simulator', 'engine'): 'mujoco'})
REPEATS = 3
STANDING = 300.0  # s simulated, over which memory may grow
WINDOW = 0.3, 0.9  # share of the standing between which growth counts: settled, not yet closing
KHR = [sys.executable, '-m', 'khr_cli.command', 'run']

FACTORS = 'factor', 'by computing time'

Numbers = dict[str, float]


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


def plain(motors: bool) -> Numbers:
    """Return the real-time factor of a plain PyBullet loop: set all joints, step, read them.

    It does nothing else: no contacts, no torso, no servo, no board, no sensor, no control. The
    world, the robot and its start are the twin's. Without the engine's motors it sets the torques
    that the twin reckoned, so that its motion and contacts are the twin's, which it checks; with
    them it holds the joints where they stand.
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
    plant.world.close()
    assert motors or [state[0] for state in states] == end
    return figures


def clocks() -> tuple[float, float]:
    """Return wall time and the time that this thread has computed, s."""
    return time.perf_counter(), time.thread_time()


def factors(simulated: float, began: tuple[float, float]) -> Numbers:
    """Return simulated time by wall time and by computing time since ``began``."""
    wall, computed = (now - then for now, then in zip(clocks(), began, strict=True))
    return {'factor': simulated / wall, 'by computing time': simulated / computed}


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


def growth(seconds: float) -> Numbers:
    """Return by how many MiB each process grows in an hour, from so long a simulated standing."""
    log(f'memory: {seconds:g} s of standing')
    with tempfile.TemporaryDirectory() as folder:
        memory = run_khr('stand_0deg', seconds, Path(folder) / 'run', '--processes', '--no-record')
    hours = (WINDOW[1] - WINDOW[0]) * seconds / 3600.0
    return {
        name: (sizes[round(WINDOW[1] * len(sizes))] - sizes[round(WINDOW[0] * len(sizes))]) / hours
        for name, sizes in sorted(memory.items())
    }


def bag_figures(folder: Path) -> Numbers:
    """Return messages per topic against instants, and the simulator's own latency figures."""
    from tests.support.runs import Bag

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
MUJOCO_TWIN = 'offline twin, MuJoCo'
CASES: dict[str, Callable[[], Numbers]] = {
    RAW: lambda: plain(motors=False),
    MOTORS: lambda: plain(motors=True),
    TWIN: offline,
    MUJOCO_TWIN: lambda: offline(SECOND_ENGINE),
    'one process': lambda: graph('--one-process', '--no-record'),
    'one process, recorded': lambda: graph('--one-process'),
    'nine processes': lambda: graph('--processes', '--no-record'),
    'nine processes, recorded': lambda: graph('--processes'),
    'one process, realtime': lambda: graph('--one-process', '--realtime'),
    'nine processes, realtime': lambda: graph('--processes', '--realtime'),
}
WALL, COMPUTING = FACTORS
AGAINST = [
    (TWIN, RAW, 0.85, WALL),
    (TWIN, RAW, 0.85, COMPUTING),
    (TWIN, MOTORS, 0.85, WALL),
    (TWIN, MOTORS, 0.85, COMPUTING),
    (MUJOCO_TWIN, TWIN, 3.0, WALL),
    (MUJOCO_TWIN, TWIN, 3.0, COMPUTING),
    ('one process', TWIN, 0.8, WALL),
    ('one process, recorded', 'one process', 0.85, WALL),
    ('nine processes', TWIN, 0.6, WALL),
    ('nine processes, recorded', 'nine processes', 0.85, WALL),
]


def measure(repeats: int) -> dict[str, list[Numbers]]:
    """Run every case in each of so many rounds."""
    runs: dict[str, list[Numbers]] = {name: [] for name in CASES}
    for number in range(repeats):
        for name, case in CASES.items():
            log(f'round {number + 1} of {repeats}: {name}')
            runs[name].append(case())
    return runs


def log(text: str) -> None:
    """Print a line with the time on standard error."""
    print(f'{time.strftime("%X")} {text}', file=sys.stderr, flush=True)


def report(runs: dict[str, list[Numbers]], grown: Numbers, standing: float) -> str:
    """Return the results as Markdown: ratios first, then what depends more on the machine."""
    lines = [
        '# Performance',
        '',
        f'Generated by `python -m tests.benchmarks --write docs/performance.md`: '
        f'`{SCENARIO}`, {SECONDS:g} simulated seconds, {len(runs[TWIN])} round(s) of all cases; '
        'physics step 1 ms, control period 15 ms. Steps per second of wall time, or of the time '
        'that the process computed, as a ratio within a round, so that the machine and most of '
        'its load cancel; on a machine with other work the spread is wide. A goal is met if the '
        'median reaches it.',
        '',
        'The plain loop sets all 17 joints in one array call, calls stepSimulation and reads the '
        '17 joint states, and nothing else: no contacts, torso, servos, board, sensors or '
        "control. World, robot and start are the twin's. It replays the torques that the twin "
        "reckoned, so its motion and contacts are the twin's, bit for bit; with the engine's "
        'motors, it holds the joints by POSITION_CONTROL.',
        '',
        '| steps per second of | against | clock | goal | least | median | most | |',
        '|---|---|---|---|---|---|---|---|',
    ]
    for name, base, goal, clock in AGAINST:
        kind = 'wall' if clock == WALL else 'computing'
        ratios = spread(
            mine[clock] / other[clock] for mine, other in zip(runs[name], runs[base], strict=True)
        )
        shown = ' | '.join(f'{ratio:.0%}' for ratio in (goal, *ratios))
        verdict = 'met' if ratios[1] >= goal else '**missed**'
        lines.append(f'| {name} | {base} | {kind} | {shown} | {verdict} |')
    lines += [
        '',
        'Simulated time over wall time:',
        '',
        '| case | least | median | most |',
        '|---|---|---|---|',
    ]
    lines += [
        f'| {name} | '
        + ' | '.join(f'{value:.2f}' for value in spread(run['factor'] for run in each))
        + ' |'
        for name, each in runs.items()
    ]
    lines += [
        '',
        'Medians of start-up (s), memory of each process of its own (MiB), messages in '
        'the bag, messages lost, and time from a sample to its correction (ms):',
        '',
    ]
    for name, each in runs.items():
        rest = {
            key: round(statistics.median(run[key] for run in each if key in run), 2)
            for key in each[0]
            if key not in FACTORS
        }
        if rest:
            lines.append(
                f'- {name}: ' + ', '.join(f'{key} {value:g}' for key, value in rest.items())
            )
    if grown:
        lines += [
            '',
            f'Growth of memory, MiB in an hour of simulated time, from {standing:g} '
            's of standing: '
            + ', '.join(f'{name} {each:+.1f}' for name, each in grown.items())
            + '.',
        ]
    return '\n'.join(lines) + '\n'


def spread(values: Iterable[float]) -> tuple[float, float, float]:
    """Return least, median and most."""
    ordered = sorted(values)
    return ordered[0], statistics.median(ordered), ordered[-1]


def main() -> None:
    """Measure, print the report, and write it with its data if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--repeats', type=int, default=REPEATS, help='rounds of all cases')
    parser.add_argument(
        '--standing',
        type=float,
        default=STANDING,
        help='simulated s over which memory may grow; 0 leaves it out',
    )
    parser.add_argument('--write', type=Path, help='page; its JSON lies beside it')
    parser.add_argument('--read', type=Path, help='JSON to write a page from, without measuring')
    options = parser.parse_args()
    if options.read:
        found = json.loads(options.read.read_text(encoding='utf-8'))
    else:
        runs = measure(options.repeats)
        grown = growth(options.standing) if options.standing else {}
        found = {'runs': runs, 'growth': grown, 'standing_s': options.standing}
    text = report(found['runs'], found['growth'], found['standing_s'])
    print(text)
    if options.write:
        write_text(options.write, text)
        write_text(options.write.with_suffix('.json'), json.dumps(found, indent=1) + '\n')


if __name__ == '__main__':
    main()
