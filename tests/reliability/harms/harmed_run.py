"""A run that is harmed, with all that must hold at its end."""

import os
import random
import re
import subprocess
import time
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from tempfile import TemporaryDirectory

import psutil

from tests import ROOT
from tests.support.runs import KHR, children

SCENARIO = 'stand_0deg'
BOTH = ('--processes', '--one-process')
PHASES = ('start', 'run', 'end')
GONE = 5.0  # s of wall time within which nothing of a run is left
LIMIT = 150.0  # s of wall time for a case: 30 for a hang to be noticed, on a loaded machine
FIGURES = 'figures'  # in the folder of a case: what it measured, in a line
SECONDS = 3.0  # simulated, of the runs that are harmed


@dataclass(frozen=True)
class Case:
    """One harm: of a kind, to somebody, at some time; the number is that of a try, or a size."""

    kind: str
    mode: str = '--processes'
    victim: str = ''
    phase: str = ''
    number: int = 0

    @property
    def name(self):
        """What tells the case from all others."""
        return ' '.join(map(str, (self.kind, self.mode, self.victim, self.phase, self.number)))

    @property
    def chance(self):
        """Random numbers of its own, the same in every campaign."""
        return random.Random(self.name)


def command(*words, **options):
    """Run a command in the repository, or in another folder; return how it ended."""
    options = {'cwd': ROOT, 'timeout': 10 * LIMIT} | options
    return subprocess.run(
        [*map(str, words)], capture_output=True, text=True, check=False, **options
    )


def badly_ended(code, err, codes=frozenset({0})):
    """Return what is wrong with the way a command ended."""
    faults = [] if code in codes else [f'exit {code}: {err.strip()[-300:]}']
    if 'Traceback' in err or 'terminate called' in err:
        faults.append(f'a traceback: {err.strip().splitlines()[-1][:200]}')
    return faults


def left(processes):
    """Return whether some of the processes go on, and end them."""
    _, alive = psutil.wait_procs(processes, timeout=GONE)
    for each in alive:
        each.kill()
    return [f'{len(alive)} processes left after {GONE:g} s'] if alive else []


class Run:
    """A run that is being harmed, with all that must hold at its end."""

    def __init__(self, folder, mode, seconds=SECONDS, *more, env=None):
        self.folder, self.seen = folder, {}
        self.process = subprocess.Popen(
            [*KHR, 'run', SCENARIO, mode, '--duration', str(seconds), '--out', str(folder), *more],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={**os.environ, 'COLUMNS': '1000', **(env or {})},
        )

    def look(self):
        """Return the processes of the run by node, and remember them."""
        found = {}
        with suppress(psutil.Error):
            found = children(self.process)
        self.seen |= {each.pid: each for each in found.values()}
        return found

    def reach(self, phase, chance, victim=''):
        """Wait for a phase of the run, and some random time in it."""
        end = time.monotonic() + 60.0
        while time.monotonic() < end and self.process.poll() is None:
            nodes = self.look()
            if self._writes() if phase != 'start' else self._starts(nodes, victim):
                break
            time.sleep(0.01)  # polls
        time.sleep(chance.uniform(0.0, {'start': 1.0, 'run': 0.5, 'end': 1.5}[phase]))

    def _starts(self, nodes, victim):
        return victim in nodes if victim else (self.folder / 'log').is_dir()

    def _writes(self):
        return any(file.stat().st_size > 100_000 for file in self.folder.glob('bag/*.mcap'))

    def kill(self, name):
        """Kill a process of the run; return whether it still lived."""
        with suppress(psutil.Error, KeyError):
            victim = self.look()[name]
            lived = victim.status() != psutil.STATUS_ZOMBIE
            victim.kill()
            return lived
        return False

    def finish(self, codes, says=''):
        """Wait for the end; return all that fell short of what must hold."""
        faults = []
        try:
            out, err = self.process.communicate(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            out, err = self.process.communicate()
            faults.append(f'did not end within {LIMIT:g} s')
        code = self.process.returncode
        faults += left(list(self.seen.values())) + badly_ended(code, err, codes)
        for log in self.folder.glob('log/*.log'):
            text = log.read_text(errors='replace')
            faults += [f'{log.name}: {each}' for each in badly_ended(0, text)]
        if says and code == 1 and not re.search(says, err):
            faults.append(f'does not say {says}: {err.strip()[-300:]}')
        if code == 0 and right_hash() not in out:
            faults.append('exit 0 with another trajectory')
        return faults


@cache
def right_hash():
    """Return the hash of the run that is harmed, from one that is not."""
    with TemporaryDirectory() as folder:
        ended = command(
            *(*KHR, 'run', SCENARIO, '--offline', '--duration', SECONDS, '--out', folder)
        )
    return ended.stdout.split()[-1]
