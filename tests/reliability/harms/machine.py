"""The machine falls short: disk, memory, limits, another user, a clock that is set."""

import os
import re
import shutil
import time
from pathlib import Path

from tests.reliability.harms.harmed_run import (
    BOTH,
    LIMIT,
    SCENARIO,
    SECONDS,
    Run,
    badly_ended,
    command,
    right_hash,
)
from tests.support.runs import KHR

FULL = r'No space left|Disk quota exceeded|recording stopped|not a readable'
SIZES = [(mode, '', '', size) for mode in BOTH for size in (4, 40, 400)]  # kB


def disk(case, folder):
    """Run on a small file system: one line with the path, and the hash all the same."""
    if os.geteuid() != 0:
        return []
    place = folder / 'small'
    place.mkdir()
    assert not command(
        *('mount', '-t', 'tmpfs', '-o', f'size={case.number}k', 'none', place)
    ).returncode
    try:
        run = Run(place / 'run', case.mode)
        run.reach('start', case.chance)
        return run.finish({1}, FULL)
    finally:
        command('umount', '-l', place)


def quota(case, folder):
    """Run where each file may have so much: one line with the path, and the hash all the same."""
    place = folder.resolve() / 'run'
    limits = {'QUOTA_FOLDER': str(place), 'QUOTA_BYTES': str(case.number * 1024)}
    run = Run(place, case.mode, env=_preloaded('quota', folder) | limits)
    run.reach('start', case.chance)
    return run.finish({1}, FULL)


def _preloaded(name, folder):
    """Compile what stands in for functions of the C library; return what loads it."""
    library, source = folder / f'{name}.so', Path(__file__).with_name(f'{name}.c')
    assert not command('cc', '-shared', '-fPIC', '-o', library, source).returncode
    return {'LD_PRELOAD': str(library)}


def _as_nobody(folder):
    """Return what a command of the user ``nobody`` begins with, and its environment.

    It may write into a folder.
    """
    for each in (folder, folder.parent):
        each.chmod(each.stat().st_mode | 0o011)
    shutil.chown(folder, 'nobody')
    # It may read what the superuser has installed, and do nothing else of what that one may.
    reads = [f'--{kind}-caps=+dac_read_search' for kind in ('inh', 'ambient')]
    own = {'XDG_RUNTIME_DIR': '', 'TMPDIR': str(folder), 'HOME': str(folder)}
    return ['setpriv', '--reuid', 'nobody', '--clear-groups', *reads], own


def users(case, folder):
    """Run as two users at a time: two domains, two right results."""
    place = folder / 'other'
    place.mkdir()
    own = Run(folder / 'run', case.mode)
    become, other = _as_nobody(place)
    words = [*KHR, 'run', SCENARIO, case.mode, '--duration', SECONDS, '--out', place / 'run']
    foreign = command(*become, *words, cwd=place, env=os.environ | other, timeout=LIMIT)
    faults = own.finish({0}) + badly_ended(foreign.returncode, foreign.stderr)
    return faults + ([] if right_hash() in foreign.stdout else ['the other user: another hash'])


# By what is missing: a limit of the shell, if that is it, and how the run may end.
ENVIRONMENTS = {
    'no HOME': ('', {0}),
    'read-only folder': ('', {1, 2}),
    'memory limit 300 MB': ('ulimit -v 300000', {1}),
    'memory limit 900 MB': ('ulimit -v 900000', {0, 1}),
    'file size limit': ('ulimit -f 8', {1}),
    'C locale': ('', {0}),
    '24 descriptors': ('ulimit -n 24', {0, 1}),
    '12 processes': ('ulimit -u 12', {0, 1}),
}


def environment(case, folder):
    """Run where something is missing: it works, or says so in a line."""
    limit, codes = ENVIRONMENTS[case.victim]
    out = '/proc/run' if case.victim == 'read-only folder' else folder / 'run'
    words = [*KHR, 'run', SCENARIO, case.mode, '--duration', 1, '--out', out]
    # bytecode that is cut by a limit would be read by whoever comes next
    env = {**os.environ, 'PYTHONDONTWRITEBYTECODE': '1'}
    if limit:
        words = ['sh', '-c', f'{limit}; exec "$@"', 'sh', *words]
    if case.victim == 'no HOME':
        env.pop('HOME', None)
    elif case.victim == 'C locale':
        env |= {'LC_ALL': 'C', 'PYTHONUTF8': '0'}
    elif case.victim == '12 processes':  # a limit that does not hold for the superuser
        become, other = _as_nobody(folder)
        words, env = [*become, *words], env | other
    ended = command(*words, env=env, timeout=LIMIT)
    return badly_ended(ended.returncode, ended.stderr, codes)


def clock(case, folder):
    """Set the time of day while a run goes on: it goes on, and its result is right."""
    jump = folder / 'jump'
    jump.write_text('0')
    env = _preloaded('clock_jumps', folder) | {'CLOCK_JUMP': str(jump)}
    run = Run(folder / 'run', case.mode, SECONDS, '--set', 'simulator.pace=1', env=env)
    run.reach('run', case.chance)
    for seconds in (case.number, -case.number):
        jump.write_text(str(seconds))
        time.sleep(0.5)  # of the run, by the other time
    return run.finish({0})


def removed(case, folder):
    """Remove the folder of a run while it goes on: the end says so, and has the right hash."""
    run = Run(folder / 'run', case.mode)
    run.reach('run', case.chance)
    shutil.rmtree(run.folder)
    return run.finish({0, 1}, re.escape(str(run.folder)))


# By kind: what does the harm, and the cases.
HARMS = {
    'full disk': (disk, SIZES),
    'a quota that is exceeded': (quota, SIZES),
    'two users': (users, [(mode,) for mode in BOTH]),
    'environment': (environment, [(mode, name) for mode in BOTH for name in ENVIRONMENTS]),
    'a folder removed during the run': (removed, [(mode,) for mode in BOTH]),
    'a clock that is set': (
        clock,
        [(mode, '', '', jump) for mode in BOTH for jump in (-3600, 3600, 86_400 * 365)],
    ),
}
