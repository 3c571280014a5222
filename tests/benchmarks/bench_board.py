"""Time the graph on a board: periods that come late, exchanges, sensor to servo.

``python -m tests.benchmarks.bench_board [--repeats N] [SCENARIO ...]``

The virtual board is a process of its own, on the machine's own cores; its line is a
pseudo-terminal, which takes no time, and it answers at once.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import psutil
from std_srvs.srv import Trigger

from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from tests.benchmarks.clock import log
from tests.support.runs import KHR, Bag, call, joined, wait_for

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
    repeats: int, names: Sequence[str] = SCENARIOS
) -> dict[str, dict[str, list[Measured]]]:
    """Run each scenario in each way, so often; return what was measured, by scenario and way."""
    found: dict[str, dict[str, list[Measured]]] = {}
    for number in range(repeats):
        for name in names:
            for way, option in WAYS.items():
                log(f'round {number + 1} of {repeats}: {name} on the virtual board, {way}')
                found.setdefault(name, {}).setdefault(way, []).append(on_board(name, option))
    return found


def on_board(name: str, way: str) -> Measured:
    """Run a scenario on the virtual board to its end.

    Returns:
        What became of the twin and of the robot behind the board, how many periods there were,
        the share of them that came late, in %, the node's own figures, and how many cores others
        used meanwhile.
    """
    twin = run_offline(scenarios.load(name).set_to([ENGINE])).verdict
    with tempfile.TemporaryDirectory() as folder:
        link, out = Path(folder) / 'rcb4', Path(folder) / 'run'
        serve = [*KHR, 'board', 'serve', name, '--link', link, '--set', ENGINE]
        serving = subprocess.Popen(serve, stdout=subprocess.PIPE, text=True)
        wait_for(link.is_symlink, 'the virtual board')
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
    given = parser.parse_args()
    for name, ways in measure(given.repeats, given.names).items():
        for way, runs in ways.items():
            print(name, way, *runs)


if __name__ == '__main__':
    sys.exit(main())
