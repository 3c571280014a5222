"""The machine falls short: disk, memory, limits, another user, a clock that is set."""

import os
import random
import re
import shutil
import subprocess
import time
from pathlib import Path

from tests.reliability.harms.harmed_run import (
    BOTH,
    LIMIT,
    SCENARIO,
    SECONDS,
    Case,
    Run,
    right_hash,
)
from tests.support.runs import KHR


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


def quota(case: Case, folder: Path) -> list[str]:
    """Run where each file may have so much: one line with the path, and the hash all the same."""
    place = folder.resolve() / 'run'
    limits = {'QUOTA_FOLDER': str(place), 'QUOTA_BYTES': str(case.seed * 1024)}
    run = Run(place, case.mode, env={'LD_PRELOAD': str(_library('quota', folder)), **limits})
    run.reach('start', random.Random(0))
    return run.finish({1}, r'Disk quota exceeded|recording stopped|not a readable')


def _library(name: str, folder: Path) -> Path:
    """Compile what stands in for functions of the C library."""
    library, source = folder / f'{name}.so', Path(__file__).with_name(f'{name}.c')
    subprocess.run(['cc', '-shared', '-fPIC', '-o', library, source], check=True)
    return library


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
        '12 processes': (['sh', '-c', 'ulimit -u 12; exec "$@"', 'sh', *command], {}, {0, 1}),
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


def clock(case: Case, folder: Path) -> list[str]:
    """Set the time of day while a run goes on: it goes on, and its result is right."""
    jump = folder / 'jump'
    jump.write_text('0')
    preloaded = {'LD_PRELOAD': str(_library('clock_jumps', folder)), 'CLOCK_JUMP': str(jump)}
    run = Run(folder / 'run', case.mode, SECONDS, '--set', 'simulator.pace=1', env=preloaded)
    run.reach('run', random.Random(case.name))
    for seconds in (case.seed, -case.seed):
        jump.write_text(str(seconds))
        time.sleep(0.5)  # of the run, by the other time
    return run.finish({0})


def removed(case: Case, folder: Path) -> list[str]:
    """Remove the folder of a run while it goes on: the end says so, and has the right hash."""
    run = Run(folder / 'run', case.mode)
    run.reach('run', random.Random(case.name))
    shutil.rmtree(run.folder)
    return run.finish({0, 1}, re.escape(str(run.folder)))


HARMS = {
    'full disk': disk,
    'a quota that is exceeded': quota,
    'two users': users,
    'environment': environment,
    'a folder removed during the run': removed,
    'a clock that is set': clock,
}
ENVIRONMENTS = (
    'no HOME', 'read-only folder', 'memory limit 300 MB', 'memory limit 900 MB', 'file size limit',
    'C locale', '24 descriptors', '12 processes',
)  # fmt: skip


def cases(seed: int) -> list[Case]:
    """Return the cases of these harms."""
    return [
        *(Case('full disk', mode, '', '', size) for mode in BOTH for size in (4, 40, 400)),
        *(Case('a quota that is exceeded', mode, '', '', size)
          for mode in BOTH for size in (4, 40, 400)),
        *(Case('two users', mode) for mode in BOTH),
        *(Case('environment', mode, name) for mode in BOTH for name in ENVIRONMENTS),
        *(Case('a folder removed during the run', mode, '', '', seed) for mode in BOTH),
        *(Case('a clock that is set', mode, '', '', jump)
          for mode in BOTH for jump in (-3600, 3600, 86_400 * 365)),
    ]  # fmt: skip
