"""Much at once, viewers, and runs that last."""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import psutil

from khr_bringup.graph.run_registry import RunEntry, running
from tests import ROOT
from tests.reliability.harms.harmed_run import BOTH, FIGURES, LIMIT, Case, Run
from tests.reliability.harms.viewers import trouble
from tests.support.runs import KHR


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
