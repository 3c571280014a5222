"""Time the graph on a board: periods that come late, exchanges, sensor to servo.

``python -m tests.benchmarks.bench_board [--repeats N] [--wire BAUD] [--free] [SCENARIO ...]``

The virtual board is a process of its own, on the machine's own cores; its line is a
pseudo-terminal, which takes no time, and it answers at once, unless ``--wire`` has it take the time
of a real line and board. ``--free`` times how long it takes to set the robot free instead.
"""

from __future__ import annotations

import argparse
import itertools
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import psutil
import rclpy
from rclpy.executors import SingleThreadedExecutor
from std_srvs.srv import Trigger

from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_hardware.client import TIMEOUT, connect
from khr_hardware.driver import BoardDriver
from khr_hardware.errors import BoardError
from khr_hardware.protocol.memory import BAUD_RATES, Config
from khr_hardware.virtual.faults import Fault, Faults
from tests.benchmarks.clock import log
from tests.fakes.boards import STANCE, Rig
from tests.support.runs import KHR, Bag, call, joined, wait_for
from tests.support.served import served

SCENARIOS = ('stand_0deg', 'walk_0deg', 'walk_6.99deg_ka12')
WAYS = {'one process': '--one-process', 'a process per node': '--processes'}
ENGINE = 'simulator.engine=mujoco'
HELD = ('--set', 'board.at_exit=hold')  # or the robot would fall at the end
# What the node reports: of an exchange of a period with the board; from a sample to the correction
# that answers it; from there to the servos.
FIGURES = tuple(
    f'{name}_p{share}_ms'
    for name in ('exchange', 'latency', 'sensor_to_servo')
    for share in (50, 99)
)
Measured = dict[str, str | float]


def measure(
    repeats: int, names: Sequence[str] = SCENARIOS, wire: int = 0
) -> dict[str, dict[str, list[Measured]]]:
    """Run each scenario in each way, so often; return what was measured, by scenario and way."""
    found: dict[str, dict[str, list[Measured]]] = {}
    for number in range(repeats):
        for name in names:
            for way, option in WAYS.items():
                log(f'round {number + 1} of {repeats}: {name} on the virtual board, {way}')
                found.setdefault(name, {}).setdefault(way, []).append(on_board(name, option, wire))
    return found


def on_board(name: str, way: str, wire: int = 0) -> Measured:
    """Run a scenario on the virtual board to its end.

    Args:
        name: of the scenario.
        way: option of ``khr run``.
        wire: rate of a line that takes its time; 0 for one that takes none.

    Returns:
        What became of the twin and of the robot behind the board, how many periods there were,
        the share of them that came late, in %, the node's own figures, and how many cores others
        used meanwhile.
    """
    twin = run_offline(scenarios.load_scenario(name).set_to([ENGINE])).verdict
    with tempfile.TemporaryDirectory() as folder:
        link, out = Path(folder) / 'rcb4', Path(folder) / 'run'
        serving = serve(name, link, wire)
        run = subprocess.Popen(
            [*KHR, 'run', name, '--board', link, '--out', out, '--no-draw', way, *HELD],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        with joined(out) as node:
            answer = call(node, Trigger, 'board/start', Trigger.Request())
            assert answer.success, answer.message
        others = cores_of_others(run, (run.pid, serving.pid))
        serving.terminate()
        said, _ = serving.communicate()
        outcome = json.loads((out / 'outcome.json').read_text())
        periods = int(outcome['periods'])
        return {
            'twin': twin,
            'robot': said.splitlines()[-3].split()[0],
            'periods': periods,
            'late': 100.0 * int(outcome['missed_periods']) / periods,
            **_newest(out / 'bag'),
            'others': others,
        }


def serve(name: str, link: Path, wire: int = 0) -> subprocess.Popen[str]:
    """Start a virtual board, on a line of a rate that takes its time if there is one."""
    words = [*KHR, 'board', 'serve', name, '--link', link, '--set', ENGINE]
    words += ['--wire'] if wire else []
    serving = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    wait_for(link.is_symlink, 'the virtual board')
    if wire:
        client, _ = connect(str(link))
        code = BAUD_RATES.index(wire) << 6
        client.set_config(Config(client.config().word & ~0xC0 | code))
        client.close()
    return serving


def free(way: str, rounds: int) -> dict[str, list[float]]:
    """Return how long it takes to set the robot free, ms, of each kind.

    By the service of a run, from its call to its answer; by ``khr board free``; by the driver alone
    over a line that loses every other reply, with the period that is in its way; and until it is
    given up on a board that is silent.
    """
    found: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        link, out = Path(folder) / 'rcb4', Path(folder) / 'run'
        serving = serve('stand_0deg', link)
        run = subprocess.Popen(
            [*KHR, 'run', 'stand_0deg', '--board', link, '--out', out, '--no-record', way],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        with joined(out) as node:
            executor = SingleThreadedExecutor(context=node.context)
            clients = {
                name: node.create_client(Trigger, f'board/{name}') for name in ('start', 'free')
            }
            for _ in range(rounds):
                for name, client in clients.items():
                    client.wait_for_service(60.0)
                    time.sleep(0.1)  # s of ramp
                    began = time.monotonic()
                    asked = client.call_async(Trigger.Request())
                    rclpy.spin_until_future_complete(node, asked, executor, 60.0)
                    assert asked.result().success
                    if name == 'free':
                        found.setdefault('service', []).append(time.monotonic() - began)
            domain = str(node.context.get_domain_id())
            for _ in range(3):
                began = time.monotonic()
                subprocess.run([*KHR, 'board', 'free', '--domain', domain], check=True)
                found.setdefault('command', []).append(time.monotonic() - began)
        for process in (run, serving):
            process.terminate()
            process.wait()
    for kind in ('every other reply lost', 'silent'):
        for _ in range(rounds):
            found.setdefault(kind, []).append(_free_on_bad_line(kind == 'silent'))
    return {kind: [1e3 * each for each in times] for kind, times in found.items()}


def _free_on_bad_line(silent: bool) -> float:
    """Return how long a period and free take on a line that has just become bad, s."""
    rig, faults = Rig(), Faults()
    with (
        tempfile.TemporaryDirectory() as folder,
        served(rig.board, Path(folder), faults=faults) as (_, line),
    ):
        client, _ = connect(line, 1_250_000, timeout=1.0)
        driver = BoardDriver(client, rig.driver.map, rig.parameters())
        driver.connect()
        driver.start()
        client._port.timeout = TIMEOUT  # of pyserial: from here on the line is bad
        faults.add(*([Fault('lost', count=10**6)] if silent else []))
        attempt, count = client._attempt, itertools.count()

        def every_other(request, size):
            faults.add(*([Fault('lost')] if next(count) % 2 == 0 and not silent else []))
            return attempt(request, size)

        client._attempt = every_other
        began = time.monotonic()
        driver.step(STANCE)
        driver.measure()
        with suppress(BoardError):
            driver.free()
        took = time.monotonic() - began
        assert (driver.state == 'idle') != silent
        client.close()
        return took


def cores_of_others(run: subprocess.Popen[bytes], own: Sequence[int]) -> float:
    """Wait for the end of a run; return how many cores others used until then."""
    began, busy = time.monotonic(), _busy()
    before, used = _used(own), 0.0
    while run.poll() is None:
        used = max(used, _used(own) - before)
        time.sleep(0.2)  # a sample
    return max(0.0, _busy() - busy - used) / (time.monotonic() - began)


def _busy() -> float:
    """Return the time that all cores have computed, s."""
    times = psutil.cpu_times()
    return float(sum(times) - times.idle - times.iowait - times.guest - times.guest_nice)


def _used(pids: Sequence[int]) -> float:
    """Return the time that processes and all below them have computed, s."""
    total = 0.0
    with suppress(psutil.Error):
        for pid in pids:
            process = psutil.Process(pid)
            for each in (process, *process.children(recursive=True)):
                times = each.cpu_times()
                total += times.user + times.system
    return total


def _newest(bag: Path) -> dict[str, float]:
    """Return the last figures of the node in a bag."""
    values = {
        pair.key: pair.value
        for _, array in Bag(bag)['/diagnostics']
        for status in array.status
        if status.name == 'board'
        for pair in status.values
    }
    return {name: float(values[name]) for name in FIGURES if values.get(name)}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('names', nargs='*', default=SCENARIOS, metavar='SCENARIO')
    parser.add_argument('--repeats', type=int, default=1, help='rounds of all cases')
    parser.add_argument('--wire', type=int, default=0, help='rate of a line that takes its time')
    parser.add_argument('--free', action='store_true', help='time how long it takes to set free')
    given = parser.parse_args()
    if given.free:
        for way, option in WAYS.items():
            for kind, times in free(option, given.repeats).items():
                print(
                    f'{way}: {kind}: p50 {statistics.median(times):.1f} ms, most {max(times):.1f}'
                )
        return
    for name, ways in measure(given.repeats, given.names, given.wire).items():
        for way, runs in ways.items():
            print(name, way, *runs)


if __name__ == '__main__':
    sys.exit(main())
