"""Time the graph on the virtual board: late periods, exchanges, sensor to servo.

``python -m tests.benchmarks.board [--repeats N] [--wire BAUD] [--free] [SCENARIO ...]``

The virtual board is another process of this machine. Its line is a pseudo-terminal without delay,
and it answers at once, unless ``--wire`` gives it the delays of a real line and board. ``--free``
times how long it takes to free the servos instead.
"""

import argparse
import itertools
import json
import resource
import statistics
import subprocess
import tempfile
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from unittest.mock import patch

import psutil
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_hardware.client import TIMEOUT, connect
from khr_hardware.driver import BoardDriver
from khr_hardware.errors import BoardError
from khr_hardware.gyro import REST_SAMPLES
from khr_hardware.protocol.memory import BAUD_RATES, Config
from khr_hardware.virtual.server import Fault, Faults
from tests.benchmarks.clock import log
from tests.benchmarks.graphs import last_diagnostics
from tests.fakes.boards import STANCE, Rig
from tests.support.runs import KHR, Bag, call, joined, wait_for
from tests.support.served import served

SCENARIOS = ('stand_0deg', 'walk_0deg', 'walk_6.99deg_ka12')
MODES = {'one process': '--one-process', 'a process per node': '--processes'}
ENGINE = 'simulator.engine=mujoco'
# The node reports these of an exchange in a period, of a sample to its correction, and of the
# correction to the servos.
FIGURES = tuple(
    f'{name}_p{share}_ms'
    for name in ('exchange', 'latency', 'sensor_to_servo')
    for share in (50, 99)
)


def measure(names=SCENARIOS, repeats=1, wire=0):
    """Return the results of each scenario in each mode."""
    found = {}
    for name, mode, _ in itertools.product(names, MODES, range(repeats)):
        log(f'board: {name}, {mode}')
        found.setdefault(name, {}).setdefault(mode, []).append(on_board(name, MODES[mode], wire))
    return found


@contextmanager
def run_on_board(name, *options, wire=0):
    """Start a run on a virtual board; yield its folder, its process and the board's."""
    with tempfile.TemporaryDirectory() as folder:
        link, out = Path(folder) / 'rcb4', Path(folder) / 'run'
        serve = [*KHR, 'board', 'serve', name, '--link', link, '--set', ENGINE]
        serving = subprocess.Popen(
            [*serve, *(['--wire'] if wire else [])], stdout=subprocess.PIPE, text=True
        )
        wait_for(link.is_symlink, 'the virtual board')
        if wire:
            client, _ = connect(str(link))
            code = BAUD_RATES.index(wire) << 6
            client.set_config(Config(client.config().word & ~0xC0 | code))
            client.close()
        run = subprocess.Popen(
            [*KHR, 'run', name, '--board', link, '--out', out, *options],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            yield out, run, serving
        finally:
            for process in (run, serving):
                process.terminate()
                process.wait()


def on_board(name, option, wire=0):
    """Run a scenario on the virtual board to its end; return what the page shows of it."""
    twin = run_offline(scenarios.load_scenario(name).set_to([ENGINE])).verdict
    hold = ('--no-draw', option, '--set', 'board.at_exit=hold')  # or the robot falls at the end
    began, busy, own = time.monotonic(), machine_time(), own_time()
    with run_on_board(name, *hold, wire=wire) as (out, run, serving):
        with joined(out) as node:
            answer = call(node, Trigger, 'board/start', Trigger.Request())
            assert answer.success, answer.message
        run.wait()
        serving.terminate()
        robot = serving.communicate()[0].splitlines()[-3].split()[0]
        outcome = json.loads((out / 'outcome.json').read_text())
        latest = last_diagnostics(Bag(out / 'bag'), 'board')
    others = (machine_time() - busy - own_time() + own) / (time.monotonic() - began)
    periods = outcome['periods']
    return {
        'twin': twin,
        'robot': robot,
        'periods': periods,
        'late': 100.0 * outcome['missed_periods'] / periods,
        **{name: float(latest.get(name) or 'nan') for name in FIGURES},
        'others': max(0.0, others),
    }


def machine_time():
    """Return the computing time of all cores, s."""
    times = psutil.cpu_times()
    return sum(times) - times.idle - times.iowait - times.guest - times.guest_nice


def own_time():
    """Return the computing time of this process and of all that it has waited for, s."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def free(option, rounds):
    """Return how long it takes to free the servos, ms, by kind.

    ``service`` is the service of a run, ``command`` is ``khr board free``; the others are the
    driver alone, on a line that loses every other reply, and until it gives up a silent board.
    """
    found = {'service': [], 'command': []}
    with run_on_board('stand_0deg', '--no-record', option) as (out, _, _), joined(out) as node:
        executor = SingleThreadedExecutor(context=node.context)
        start, freeing = (
            node.create_client(Trigger, f'board/{name}') for name in ('start', 'free')
        )
        for client in (start, freeing):
            assert client.wait_for_service(60.0)

        def ask(client):
            asked = client.call_async(Trigger.Request())
            rclpy.spin_until_future_complete(node, asked, executor, 60.0)
            assert asked.result().success

        for _ in range(rounds):
            ask(start)
            time.sleep(0.1)  # s of ramp
            found['service'].append(duration(lambda: ask(freeing)))
        command = [*KHR, 'board', 'free', '--domain', str(node.context.get_domain_id())]
        for _ in range(3):
            found['command'].append(duration(lambda: subprocess.run(command, check=True)))
    for kind, silent in (('every other reply lost', False), ('silent', True)):
        found[kind] = [free_on_bad_line(silent) for _ in range(rounds)]
    return {kind: [1e3 * each for each in times] for kind, times in found.items()}


def duration(function):
    """Return the wall time of a call, s."""
    began = time.monotonic()
    function()
    return time.monotonic() - began


def free_on_bad_line(silent):
    """Return the wall time of a period and of freeing on a line that has just become bad, s."""
    rig, faults, count = Rig(), Faults(), itertools.count()
    with (
        tempfile.TemporaryDirectory() as folder,
        served(rig.board, Path(folder), faults=faults) as (_, line),
    ):
        client, _ = connect(line, 1_250_000, timeout=1.0)
        driver = BoardDriver(client, rig.driver.map, rig.parameters())
        driver.connect()
        for _ in range(REST_SAMPLES):
            driver.measure()
        driver.start()
        client._port.timeout = TIMEOUT  # of pyserial: from here on the line is bad
        faults.add(*([Fault('lost', count=10**6)] if silent else []))
        attempt = client._attempt

        def every_other(request, size):
            faults.add(*([Fault('lost')] if next(count) % 2 == 0 and not silent else []))
            return attempt(request, size)

        def period_and_free():
            driver.step(STANCE)
            driver.measure()
            with suppress(BoardError):
                driver.free()

        with patch.object(client, '_attempt', every_other):
            took = duration(period_and_free)
        assert (driver.state == 'idle') != silent
        client.close()
        return took


def main():
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('names', nargs='*', default=SCENARIOS, metavar='SCENARIO')
    parser.add_argument('--repeats', type=int, default=1, help='rounds of all cases')
    parser.add_argument('--wire', type=int, default=0, help='baud rate of a line with delays')
    parser.add_argument('--free', action='store_true', help='time how long freeing takes')
    given = parser.parse_args()
    if not given.free:
        print(json.dumps(measure(given.names, given.repeats, given.wire), indent=1))
        return
    for mode, option in MODES.items():
        for kind, times in free(option, given.repeats).items():
            print(f'{mode}: {kind}: p50 {statistics.median(times):.1f} ms, most {max(times):.1f}')


if __name__ == '__main__':
    main()
