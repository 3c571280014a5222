"""Much at once, viewers, and runs that last."""

import logging
import os
import random
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

import numpy as np
import psutil

from khr_bringup.graph.run_registry import RunEntry, running
from khr_common.processes import tied_to_parent
from tests import ROOT
from tests.reliability.harms.harmed_run import BOTH, FIGURES, LIMIT, Case, Run
from tests.support.browser import free_port, viewer
from tests.support.runs import KHR, finish, khr, start_khr, wait_for

VIEWERS = 10  # of each page
LONGEST = 5.0  # s of wall time that a viewer stays
WALK = ('run', 'walk_6.99deg_ka12', '--set', 'simulator.engine=mujoco')


@contextmanager
def busy(loops: int) -> Iterator[None]:
    """Keep so many cores busy; whatever ends this process ends the loops."""
    with ExitStack() as stack:
        for _ in range(loops):
            loop = subprocess.Popen(
                [sys.executable, '-c', 'while True: pass'], preexec_fn=tied_to_parent()
            )
            stack.callback(loop.wait)
            stack.callback(loop.kill)
        yield


def flood(case: Case, folder: Path) -> list[str]:
    """Change a parameter 500 times a second, or call 220 services at once: it verifies after."""
    run = Run(folder / 'run', case.mode, 600.0, '--set', 'simulator.pace=2')
    run.reach('run', random.Random(case.name))
    entry = _entry(run)
    hammered = subprocess.run(
        [sys.executable, '-m', 'tests.reliability.harms.hammer', case.victim],
        cwd=ROOT, env={**os.environ, **entry.environment()} if entry else None,
        capture_output=True, text=True, check=False, timeout=LIMIT,
    )  # fmt: skip
    run.process.send_signal(signal.SIGINT)
    faults = run.finish({130})
    if hammered.returncode != 0:
        faults.append(f'hammer: {hammered.stderr[-300:]}')
    (folder / FIGURES).write_text(f'{case.mode} {case.victim}: {hammered.stdout.strip()}')
    verified = subprocess.run(
        [*KHR, 'verify', str(folder / 'run')], capture_output=True, text=True, check=False
    )
    if verified.returncode != 0:
        faults.append(f'verify: exit {verified.returncode}: {verified.stderr[-300:]}')
    return faults


def _entry(run: Run) -> RunEntry | None:
    return next((each for each in running() if each.folder == str(run.folder)), None)


def viewers(case: Case, folder: Path) -> list[str]:
    """Let ten viewers each of a live page and of a playback come and go, beside busy loops."""
    faults, figures = trouble(folder, float(case.seed))
    (folder / FIGURES).write_text(figures)
    return faults


def trouble(folder: Path, seconds: float, seed: int = 0) -> tuple[list[str], str]:
    """Let viewers come and go for ``seconds`` of wall time.

    Args:
        folder: for the runs.
        seconds: of wall time.
        seed: of when each viewer comes, how long it stays, and whether it reads.

    Returns:
        What fell short, and how many visits there were.
    """
    # The client logs an error of its own if the other side hangs up while it does.
    logging.getLogger('websockets.client').setLevel(logging.CRITICAL)
    recorded, live = folder / 'recorded', folder / 'live'
    khr(*WALK, '--duration', 4, '--out', recorded, timeout=300)
    # No faster than the clock, so it is still there when the last viewer has left.
    long = (*WALK, '--set', 'simulator.pace=1', '--duration', seconds + 5.0)
    port = free_port()
    run = start_khr(*long, '--view', '--out', live)
    play = start_khr('view', recorded, '--against', recorded, '--no-browser', '--port', port)
    faults, visits = list[str](), list[int]()
    ports = [_port(run), _port(play)]
    with busy(psutil.cpu_count() or 1):
        end = time.monotonic() + seconds
        guests = [
            threading.Thread(
                target=_visit,
                args=(each, end, random.Random(f'{seed} {each} {n}'), faults, visits),
            )
            for n in range(VIEWERS)
            for each in ports
        ]
        for guest in guests:
            guest.start()
        for guest in guests:
            guest.join()
    play.send_signal(2)
    ended = {'khr view': finish(play, recorded, 60), 'khr run': finish(run, live, seconds + 300.0)}
    for name, each in ended.items():
        if each.code != 0:
            faults.append(f'{name}: exit {each.code}: {each.err.strip()[-300:]}')
    said = {name: each.err for name, each in ended.items()}
    said |= {path.name: path.read_text(errors='replace') for path in live.glob('log/*.log')}
    faults += [
        f'{name}: {text.strip()[-300:]}' for name, text in said.items() if 'Traceback' in text
    ]
    alone = khr(*long, '--offline', '--out', folder / 'alone', timeout=seconds + 300.0)
    if not faults and ended['khr run'].hash != alone.hash:
        faults.append(f'hash {ended["khr run"].hash}, without viewers {alone.hash}')
    return faults, f'{len(visits)} visits in {seconds:g} s, {sum(visits) / 1e6:.0f} MB read'


def _port(process: subprocess.Popen[str]) -> int:
    stderr = process.stderr
    assert stderr is not None
    line = wait_for(lambda: re.search(r'page: http://127.0.0.1:(\d+)/', stderr.readline()), 'page')
    return int(line[1])


def _visit(
    port: int, end: float, chance: random.Random, faults: list[str], visits: list[int]
) -> None:
    """Open a page and leave it, again and again; one of five viewers reads nothing."""
    while time.monotonic() < end:
        time.sleep(chance.uniform(0.0, 1.0))  # when it comes
        try:
            with viewer(port, reads=chance.random() > 0.2) as got:
                time.sleep(chance.uniform(0.0, LONGEST))  # how long it stays
            visits.append(sum(got))
        except Exception as error:  # of whatever kind: the viewer could not look
            faults.append(f'a viewer: {type(error).__name__}: {error}')


def soak(case: Case, folder: Path) -> list[str]:
    """Run for long: memory does not grow, nothing is lost."""
    run = Run(folder / 'run', case.mode, float(case.seed))
    samples: list[tuple[int, float]] = []  # processes, and their memory, MB
    while run.process.poll() is None:
        with suppress(psutil.Error):
            sizes = [each.memory_info().rss / 1e6 for each in run.look().values()]
            samples.append((sum(size > 0.0 for size in sizes), sum(sizes)))
        time.sleep(1.0)  # a sample
    _, err = run.process.communicate()
    faults = (
        [] if run.process.returncode == 0 else [f'exit {run.process.returncode}: {err[-300:]}']
    )
    most, middle, end = growth(samples)
    if end > 1.05 * middle:
        faults.append(f'memory grew from {middle:.0f} to {end:.0f} MB')
    bag = folder / 'run' / 'bag'
    large = sum(file.stat().st_size for file in bag.glob('*')) / 1e6
    (folder / FIGURES).write_text(
        f'{case.seed} s {case.mode}: memory of {most} processes {middle:.0f} MB after half of it, '
        f'{end:.0f} MB at the end; bag {large:.0f} MB'
    )
    return faults + _lost(bag, float(case.seed))


def growth(samples: list[tuple[int, float]]) -> tuple[int, float, float]:
    """Return how many processes there were, and their memory in the middle and at the end.

    Args:
        samples: how many processes there were, and their memory; those with fewer processes than
            the most, when they start and end, do not count.
    """
    most = max(count for count, _ in samples)
    whole = [size for count, size in samples if count == most]
    tenth, half = max(1, len(whole) // 10), len(whole) // 2
    return most, float(np.median(whole[half : half + tenth])), float(np.median(whole[-tenth:]))


def _lost(bag: Path, seconds: float) -> list[str]:
    from rosbags.rosbag2 import Reader

    from khr_common.interfaces import TRUE_FORCES

    expected = round(seconds / 0.015) + 1
    with Reader(bag) as reader:
        counts = {topic: info.msgcount for topic, info in reader.topics.items()}
    wanted = ['/joint_reference', '/imu/data_raw', *(f'/{topic.name}' for topic in TRUE_FORCES)]
    return [
        f'{topic}: {counts.get(topic, 0)} of {expected} messages'
        for topic in wanted
        if counts.get(topic, 0) < expected
    ]


HARMS = {
    '500 changes a second, 220 calls at once': flood,
    'ten viewers that come and go': viewers,
    'soak': soak,
}


def cases(seed: int, soak_seconds: int) -> list[Case]:
    """Return the cases of these harms."""
    return [
        *(Case('500 changes a second, 220 calls at once', mode, victim, '', seed)
          for mode in BOTH for victim in ('changes', 'calls')),
        Case('ten viewers that come and go', '', 'run and playback', '', 600),
        *(Case('soak', mode, '', '', soak_seconds) for mode in BOTH),
    ]  # fmt: skip
