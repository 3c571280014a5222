"""Speed of a graph, of the offline twin and of the physics alone; start-up, memory and latency."""

import json
import subprocess
import tempfile
import time
from collections import Counter
from contextlib import ExitStack, suppress
from functools import cache, partial
from pathlib import Path
from unittest.mock import patch

import psutil

from khr_bringup.offline import ControlLoop, run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_sim.physics.engines import bullet as pybullet
from khr_sim.physics.engines.mujoco import MuJoCo
from khr_sim.physics.world import World
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from tests.benchmarks.clock import WALL, clocks, log, speeds, timed
from tests.support.runs import KHR, Bag, children

SCENARIO, SECONDS = 'walk_0deg', 6.0
SHORT = scenarios.load_scenario(SCENARIO).changed({('simulator', 'duration'): SECONDS})
RAW, MOTORS, TWIN = 'plain loop', "plain loop, engine's motors", 'offline twin'
STEPS, MUJOCO_TWIN = "the twin's steps alone", 'offline twin, MuJoCo'
MUJOCO_ALONE = 'the twin, beside the graphs, MuJoCo'
ONE, ONE_RECORDED = 'one process', 'one process, recorded'
EACH, EACH_RECORDED = 'a process per node', 'a process per node, recorded'
MUJOCO_ONE, MUJOCO_ONE_RECORDED = f'{ONE}, MuJoCo', f'{ONE_RECORDED}, MuJoCo'
MUJOCO_EACH, MUJOCO_EACH_RECORDED = f'{EACH}, MuJoCo', f'{EACH_RECORDED}, MuJoCo'
LATENCY = 'latency_p50_ms', 'latency_p99_ms'
bullet = pybullet.bullet


def on(engine):
    """Return the scenario on an engine."""
    return SHORT.changed({('simulator', 'engine'): engine})


@cache
def twin_torques():
    """Return the joints of the twin, their torques in every step, and their final angles, rad."""
    joints, torques, positions = [], [], []
    real = bullet.setJointMotorControlArray

    def motors(*arguments, **options):
        if arguments[2] == bullet.TORQUE_CONTROL:
            joints[:] = arguments[1]
            torques.append(options['forces'])
        real(*arguments, **options)

    with patch.object(bullet, 'setJointMotorControlArray', motors):
        run_offline(SHORT, lambda truth, *_: positions.append(truth.joint_position.tolist()))
    return joints, torques, positions[-1]


def plain(motors=False):
    """Return the speed of a loop that only sets all joints, steps PyBullet and reads the joints.

    Without ``motors`` it replays the torques of the twin, and checks that the motion is the same;
    with them it holds the initial angles by position control.
    """
    joints, torques, end = twin_torques()
    plant = Plant([SHORT.table(RunParameters)])
    plant.start([ControlLoop(SHORT).reference(0.0)])
    (robot,) = plant.world.engine.bodies
    body, client = robot.body, robot.client
    held = [bullet.getJointState(body, i, client)[0] for i in joints]
    control = bullet.POSITION_CONTROL if motors else bullet.TORQUE_CONTROL
    key = 'targetPositions' if motors else 'forces'
    began = clocks()
    for torque in torques:
        bullet.setJointMotorControlArray(
            body, joints, control, physicsClientId=client, **{key: held if motors else torque}
        )
        bullet.stepSimulation(client)
        states = bullet.getJointStates(body, joints, client)
    spent = clocks() - began
    plant.close()
    assert motors or [state[0] for state in states] == end
    return speeds(len(torques) * plant.parameters[0].physics_step, spent)


def steps():
    """Return the speed of the twin's physics steps: engine, servos, contacts and joint states."""
    spent = {STEPS: 0.0}
    with timed(pybullet.Bullet, 'run', spent, STEPS):
        simulated = run_offline(SHORT).time
    return {WALL: simulated / spent[STEPS]}


def offline(scenario=SHORT):
    """Return the speed of the offline twin from its first control period on."""
    began = []
    seconds = run_offline(scenario, lambda *_: began or began.append(clocks())).time
    return speeds(seconds, clocks() - began[0])


def graph(*options):
    """Return speed, start-up, memory and, if it is recorded, latency of a graph."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / 'run'
        command = [*KHR, 'run', SCENARIO, '--duration', str(SECONDS), '--no-draw', *options]
        memory = sampled_memory([*command, '--out', out])
        outcome = json.loads((out / 'outcome.json').read_text())
        return {
            WALL: float(outcome['real_time_factor']),
            'startup_s': float(outcome['startup_s']),
            **{f'MiB {name}': size for name, size in sorted(memory.items())},
            **(bag_figures(out / 'bag') if (out / 'bag').exists() else {}),
        }


def sampled_memory(command):
    """Run khr; return the largest unshared memory of each of its processes, MiB."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    memory = Counter()
    while process.poll() is None:
        with suppress(psutil.Error):
            for name, child in children(process).items():
                memory[name] = max(memory[name], child.memory_full_info().uss / 2**20)
        time.sleep(0.5)  # a sample
    return memory


def bag_figures(folder):
    """Return the number of messages, of lost ones, and the latency of the simulator, ms."""
    bag = Bag(folder)
    stamps = {message.clock.sec * 10**9 + message.clock.nanosec for _, message in bag['/clock']}
    measured = ('/ground_truth', '/imu', '/foot_force', '/joint')
    lost = sum(len(stamps) - len(bag[topic]) for topic in bag if topic.startswith(measured))
    latest = last_diagnostics(bag, 'simulator')
    return {
        'messages': sum(map(len, bag.values())),
        'lost': lost,
        **{key: float(latest[key]) for key in LATENCY if latest.get(key)},
    }


def last_diagnostics(bag, name):
    """Return the last value of each key in the diagnostics of a node."""
    return {
        pair.key: pair.value
        for _, array in bag['/diagnostics']
        for status in array.status
        if status.name == name
        for pair in status.values
    }


GRAPHS = {
    ONE: ('--one-process', '--no-record'),
    ONE_RECORDED: ('--one-process',),
    EACH: ('--processes', '--no-record'),
    EACH_RECORDED: ('--processes',),
}
CASES = {
    RAW: plain,
    STEPS: steps,
    MOTORS: lambda: plain(motors=True),
    TWIN: offline,
    MUJOCO_TWIN: lambda: offline(on('mujoco')),
    **{name: partial(graph, *options) for name, options in GRAPHS.items()},
    'one process, realtime': partial(graph, '--one-process', '--realtime'),
    'a process per node, realtime': partial(graph, '--processes', '--realtime'),
}
MUJOCO_CASES = {
    MUJOCO_ALONE: CASES[MUJOCO_TWIN],
    **{
        f'{name}, MuJoCo': partial(graph, *options, '--engine', 'mujoco')
        for name, options in GRAPHS.items()
    },
}


def measure(cases=CASES):
    """Return speed, memory and latency of every case."""
    found = {}
    for name, case in cases.items():
        log(f'graphs: {name}')
        found[name] = case()
    return found


ENGINE_STEPS, AROUND = "the engine's steps", 'servos, joint states and contacts around them'
BOTH, REST = 'steps, servos and contacts, compiled together', 'the rest'
PARTS = (
    (World, '_observe', 'poses and forces observed'),
    (ControlLoop, 'answer', 'sensors, gait, controllers and verdict'),
)
ENGINES = {
    'bullet': ((bullet, 'stepSimulation', ENGINE_STEPS), (pybullet.Bullet, 'run', AROUND)),
    'mujoco': ((MuJoCo, 'run', BOTH),),
}


def period(engine):
    """Return the wall time of each part of a control period of the twin on an engine, us.

    The rest is board, clock, hash and loop.
    """
    parts = (*ENGINES[engine], *PARTS)
    spent, began = {part: 0.0 for *_, part in parts}, []

    def watch(*_):
        if not began:
            spent.update(dict.fromkeys(spent, 0.0))
            began.append(time.perf_counter())

    with ExitStack() as stack:
        for owner, name, part in parts:
            stack.enter_context(timed(owner, name, spent, part))
        seconds = run_offline(on(engine), watch).time
    total = time.perf_counter() - began[0]
    if engine == 'bullet':
        spent[AROUND] -= spent[ENGINE_STEPS]
    spent[REST] = total - sum(spent.values())
    periods = seconds / SHORT.table(RunParameters).control_period
    return {part: 1e6 * took / periods for part, took in spent.items()}


def periods(rounds=5):
    """Return the parts of a control period by engine, of the fastest of some rounds."""
    log('a control period')
    return {
        engine: min((period(engine) for _ in range(rounds)), key=lambda of: sum(of.values()))
        for engine in ENGINES
    }
