"""The cases of the campaign: each does a run some harm and says what fell short, if anything."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from tempfile import mkdtemp

import numpy as np
import psutil

from khr_bringup.graph.run_registry import running
from khr_bringup.scenario import scenario as scenarios
from tests import ROOT
from tests.reliability.board_cases import BOARD_HARMS, board_cases
from tests.reliability.harmed_run import (
    FIGURES,
    LIMIT,
    PHASES,
    SCENARIO,
    SECONDS,
    Case,
    Run,
    right_hash,
)
from tests.reliability.more_harms import MORE, more_cases
from tests.reliability.netns import why_not
from tests.support.runs import KHR

LONGEST_LINE = 600
TRIES = 5  # runs until a process is killed before it has ended by itself


def kill(case: Case, folder: Path) -> list[str]:
    """Kill one process of a run: it is named, the rest ends, nothing raw is printed."""
    chance = random.Random(case.name)
    for number in range(TRIES):
        run = Run(folder / f'run{number}', case.mode)
        run.reach(case.phase, chance, case.victim)
        killed = run.kill(case.victim)
        faults = run.finish({0, 1}, f'{case.victim} was killed by SIGKILL')
        if killed or faults:
            return faults
    return [f'{case.victim} had ended each time before it was killed']


def stop(case: Case, folder: Path) -> list[str]:
    """Freeze one process of a run: it is named within 30 s."""
    run = Run(folder / 'run', case.mode, 600.0)
    run.reach('run', random.Random(case.name))
    victim = run.look().get(case.victim)
    if victim is None:
        return [*run.finish({0, 1}), f'no {case.victim} to freeze']
    victim.suspend()
    began = time.monotonic()
    faults = run.finish({1}, '.')
    seconds = time.monotonic() - began
    return faults + ([f'took {seconds:.0f} s to end'] if seconds > 2 * 30.0 else [])


def parent(case: Case, folder: Path) -> list[str]:
    """Kill khr itself: its children end, and the next run is not misled."""
    run = Run(folder / 'run', case.mode, 600.0)
    run.reach(case.phase, random.Random(case.name))
    run.process.kill()
    after = Run(folder / 'next', case.mode)
    faults = run.finish({-9})
    after.reach('run', random.Random(0))
    return faults + after.finish({0})


def interrupt(case: Case, folder: Path) -> list[str]:
    """Interrupt a run in some phase: exit 130 (or 0 if it was over), no process left."""
    run = Run(folder / 'run', case.mode)
    run.reach(case.phase, random.Random(case.name))
    run.process.send_signal(signal.Signals[case.victim])
    return run.finish(
        {'start': {0, 130, 1, -1, -2, -15}, 'run': {0, 130}, 'end': {0, 130, 1}}[case.phase]
    )


def disk(case: Case, folder: Path) -> list[str]:
    """Run on a small file system: one line with the path, and the hash all the same."""
    if os.geteuid() != 0:
        return []
    place = folder / 'small'
    place.mkdir()
    subprocess.run(['mount', '-t', 'tmpfs', '-o', f'size={case.seed}k', 'none', place], check=True)
    try:
        run = Run(place / 'run', case.mode)
        run.reach('start', random.Random(0))
        return run.finish({1}, r'No space left|recording stopped|not a readable')
    finally:
        subprocess.run(['umount', '-l', place], check=False)


def as_nobody(folder: Path) -> list[str]:
    """Return what a command of the user ``nobody`` begins with, who may write into a folder."""
    for each in (folder, folder.parent):
        each.chmod(each.stat().st_mode | 0o011)
    shutil.chown(folder, 'nobody')
    # It may read what the superuser has installed, and do nothing else of what that one may.
    reads = [f'--{kind}-caps=+dac_read_search' for kind in ('inh', 'ambient')]
    return ['setpriv', '--reuid', 'nobody', '--clear-groups', *reads]


def users(case: Case, folder: Path) -> list[str]:
    """Run as two users at a time: two domains, two right results."""
    other = folder / 'other'
    other.mkdir()
    own = Run(folder / 'run', case.mode)
    command = [*KHR, 'run', SCENARIO, case.mode, '--duration', str(SECONDS)]
    foreign = subprocess.run(
        [*as_nobody(other), *command, '--out', str(other / 'run')],
        cwd=other, env={**os.environ, 'XDG_RUNTIME_DIR': '', 'TMPDIR': str(other)},
        capture_output=True, text=True, check=False, timeout=LIMIT,
    )  # fmt: skip
    faults = own.finish({0})
    if foreign.returncode != 0 or right_hash() not in foreign.stdout:
        faults.append(f'the other user: exit {foreign.returncode}: {foreign.stderr[-300:]}')
    return faults


def environment(case: Case, folder: Path) -> list[str]:
    """Run where something is missing: it works, or says so in a line."""
    command = [*KHR, 'run', SCENARIO, case.mode, '--duration', '1', '--out', str(folder / 'run')]
    wrapped, changed, codes = {
        'no HOME': (command, {'HOME': None}, {0}),
        'read-only folder': ([*command[:-1], '/proc/run'], {}, {1, 2}),
        'memory limit 300 MB': (['sh', '-c', 'ulimit -v 300000; exec "$@"', 'sh', *command], {}, {1}),
        'memory limit 900 MB': (['sh', '-c', 'ulimit -v 900000; exec "$@"', 'sh', *command], {}, {0, 1}),
        'file size limit': (['sh', '-c', 'ulimit -f 8; exec "$@"', 'sh', *command], {}, {1}),
        '24 descriptors': (['sh', '-c', 'ulimit -n 24; exec "$@"', 'sh', *command], {}, {0, 1}),
        '30 processes': (['sh', '-c', 'ulimit -u 30; exec "$@"', 'sh', *command], {}, {0, 1}),
        'C locale': (command, {'LC_ALL': 'C', 'PYTHONUTF8': '0'}, {0}),
    }[case.victim]  # fmt: skip
    env = {**os.environ, **{k: v for k, v in changed.items() if v}}
    for key in [key for key, value in changed.items() if value is None]:
        env.pop(key, None)
    if 'processes' in case.victim:  # a limit that does not hold for the superuser
        wrapped = [*as_nobody(folder), *wrapped]
        env |= {'XDG_RUNTIME_DIR': '', 'TMPDIR': str(folder), 'HOME': str(folder)}
    ended = subprocess.run(
        wrapped, env=env, capture_output=True, text=True, check=False, timeout=LIMIT
    )
    faults = (
        [] if ended.returncode in codes else [f'exit {ended.returncode}: {ended.stderr[-300:]}']
    )
    if 'Traceback' in ended.stderr:
        faults.append(f'a traceback: {ended.stderr.strip().splitlines()[-1][:200]}')
    return faults


def fuzz(case: Case, _: Path) -> list[str]:
    """Read mutated files."""
    ended = subprocess.run(
        [sys.executable, '-m', 'tests.reliability.fuzz', '500', str(case.seed)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return [] if ended.returncode == 0 else ended.stdout.splitlines()[:-1] or [ended.stderr[-300:]]


def damage(case: Case, _: Path) -> list[str]:
    """Hand damaged runs to report, verify and film."""
    ended = subprocess.run(
        [sys.executable, '-m', 'tests.reliability.bag_fuzz', '50', str(case.seed)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return [] if ended.returncode == 0 else ended.stdout.splitlines()[:-1] or [ended.stderr[-300:]]


def tested(case: Case, _: Path) -> list[str]:
    """Run the tests of a file that does harm of its own; all must pass, none be left out."""
    ended = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-rs', '-p', 'no:cacheprovider', case.victim],
        cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, 'ROS_PYTHON_CHECK_FIELDS': '1'},
    )  # fmt: skip
    lines = ended.stdout.splitlines()
    faults = [line for line in lines if line.startswith(('FAILED', 'ERROR', 'SKIPPED', 'E  '))]
    if ended.returncode != 0 and not faults:
        faults = [f'exit {ended.returncode}: {(ended.stdout + ended.stderr)[-300:]}']
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


def left_over() -> list[str]:
    """Return what dead runs have left: entries of the register, locked or not, and segments."""
    dead = [entry.scenario for entry in running() if not psutil.pid_exists(entry.pid)]
    return [f'an entry of {name}' for name in dead]


HARMS = {
    'SIGKILL of a process': kill,
    'SIGSTOP of a process': stop,
    'SIGKILL of khr': parent,
    'SIGINT, SIGTERM, SIGHUP to khr': interrupt,
    'full disk': disk,
    'two users': users,
    'environment': environment,
    'mutated files, 500 each': fuzz,
    'damaged runs, 50 each': damage,
    'tests of traffic, users, network, hangs': tested,
    'soak': soak,
    **BOARD_HARMS,
    **MORE,
}


def cases(seed: int, kills: int, soak_seconds: int) -> list[Case]:
    """Return all cases of a campaign, in an order that the seed decides."""
    chance = random.Random(seed)
    both = ('--processes', '--one-process')
    victims = [('--processes', node) for node in scenarios.load(SCENARIO).nodes]
    victims.append(('--one-process', 'graph'))
    found = [
        Case('SIGKILL of a process', *victims[number % len(victims)],
             PHASES[number // len(victims) % len(PHASES)], seed + number)
        for number in range(kills)
    ]  # fmt: skip
    found += [Case('SIGSTOP of a process', mode, node, '', seed) for mode, node in victims]
    found += [Case('SIGKILL of khr', mode, '', phase, seed + n)
              for mode in both for phase in PHASES[:2] for n in range(max(1, kills // 50))]  # fmt: skip
    found += [Case('SIGINT, SIGTERM, SIGHUP to khr', mode, name, phase, seed)
              for mode in both for name in ('SIGINT', 'SIGTERM', 'SIGHUP') for phase in PHASES]  # fmt: skip
    found += [Case('full disk', mode, '', '', size) for mode in both for size in (4, 40, 400)]
    found += [Case('two users', mode) for mode in both]
    found += [
        Case('environment', mode, name)
        for mode in both
        for name in ('no HOME', 'read-only folder', 'memory limit 300 MB', 'memory limit 900 MB',
                     'file size limit', 'C locale', '24 descriptors', '30 processes')
    ]  # fmt: skip
    found += [Case('mutated files, 500 each', '', '', '', seed + n) for n in range(20)]
    found += [Case('damaged runs, 50 each', '', '', '', seed + n) for n in range(6)]
    found += [
        Case('tests of traffic, users, network, hangs', '', f'tests/{name}.py')
        for name in (
            'reliability/test_traffic',
            'reliability/test_no_hang',
            'reliability/test_closed',
            'reliability/test_other_user',
            'reliability/test_workers_elsewhere',
            'integration/test_sweep_cluster',
        )
    ]
    found += more_cases(seed)
    found += [Case('soak', mode, '', '', soak_seconds) for mode in both]
    found += [Case(*each) for each in board_cases(seed)]
    chance.shuffle(found)
    return found


def attempt(case: Case) -> tuple[list[str], str]:
    """Do a case in a folder of its own; return what fell short, and what it measured."""
    folder = Path(mkdtemp(prefix='khr-chaos-'))
    figures = ''
    try:
        faults = HARMS[case.kind](case, folder)
        with suppress(FileNotFoundError):
            figures = (folder / FIGURES).read_text()
    except Exception as error:  # of the campaign itself: it counts as a fault, and is looked into
        faults = [f'campaign: {type(error).__name__}: {error}']
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return [' '.join(fault.split())[:LONGEST_LINE] for fault in faults + left_over()], figures


NO_OTHER_MACHINE = why_not()
