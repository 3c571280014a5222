"""A run that is harmed, with all that must hold at its end."""

import os
import random
import re
import subprocess
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

import psutil

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
    """One harm: of a kind, to somebody, at some time."""

    kind: str
    mode: str = '--processes'
    victim: str = ''
    phase: str = ''
    seed: int = 0

    @property
    def name(self) -> str:
        """Return what tells the case from all others."""
        return ' '.join(map(str, (self.kind, self.mode, self.victim, self.phase, self.seed)))


class Run:
    """A run that is being harmed, with all that must hold at its end."""

    def __init__(
        self,
        folder: Path,
        mode: str,
        seconds: float = SECONDS,
        *more: str,
        env: Mapping[str, str] = MappingProxyType({}),
    ) -> None:
        self.folder, self.faults = folder, list[str]()
        self.process = subprocess.Popen(
            [*KHR, 'run', SCENARIO, mode, '--duration', str(seconds), '--out', str(folder), *more],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
            env={**os.environ, 'COLUMNS': '1000', **env},
        )  # fmt: skip
        self.seen: dict[int, psutil.Process] = {}

    def look(self) -> dict[str, psutil.Process]:
        """Return the processes of the run by node, and remember them."""
        found = {}
        with suppress(psutil.Error):
            found = children(self.process)
        self.seen |= {each.pid: each for each in found.values()}
        return found

    def reach(self, phase: str, chance: random.Random, victim: str = '') -> None:
        """Wait for a phase of the run, and some random time in it."""
        log = self.folder / 'log'
        conditions = {
            'start': lambda: victim in self.look() or (not victim and log.is_dir()),
            'run': lambda: (self.folder / 'bag').is_dir() and self._simulating(),
            'end': lambda: (self.folder / 'bag').is_dir() and self._simulating(),
        }
        end = time.monotonic() + 60.0
        while not conditions[phase]() and time.monotonic() < end and self.process.poll() is None:
            self.look()
            time.sleep(0.01)  # polls
        self.look()
        time.sleep(chance.uniform(*{'start': (0, 1), 'run': (0, 0.5), 'end': (0, 1.5)}[phase]))

    def _simulating(self) -> bool:
        bag = self.folder / 'bag'
        return any(file.stat().st_size > 100_000 for file in bag.glob('*.mcap'))

    def kill(self, name: str) -> bool:
        """Kill a process of the run; return whether it still lived."""
        with suppress(psutil.Error, KeyError):
            victim = self.look()[name]
            lived = victim.status() != psutil.STATUS_ZOMBIE
            victim.kill()
            return lived
        return False

    def finish(self, codes: set[int], says: str = '') -> list[str]:
        """Wait for the end; return all that fell short of what must hold."""
        try:
            out, err = self.process.communicate(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            out, err = self.process.communicate()
            self.faults.append(f'did not end within {LIMIT:g} s')
        self._left()
        code = self.process.returncode
        if code not in codes:
            self.faults.append(f'exit {code}: {err.strip()[-300:]}')
        if says and code == 1 and not re.search(says, err):
            self.faults.append(f'does not say {says}: {err.strip()[-300:]}')
        self._texts({'stderr': err, **self._logs()})
        found = re.search(r'trajectory hash ([0-9a-f]{64})', out)
        if code == 0 and (not found or found[1] != right_hash()):
            self.faults.append('exit 0 with another trajectory')
        return self.faults

    def _left(self) -> None:
        _, alive = psutil.wait_procs(list(self.seen.values()), timeout=GONE)
        if alive:
            self.faults.append(f'{len(alive)} processes left after {GONE:g} s')
        for each in alive:
            each.kill()

    def _logs(self) -> dict[str, str]:
        return {
            path.name: path.read_text(errors='replace') for path in self.folder.glob('log/*.log')
        }

    def _texts(self, texts: dict[str, str]) -> None:
        for name, text in texts.items():
            if 'Traceback' in text or 'terminate called' in text:
                self.faults.append(f'{name}: {text.strip().splitlines()[-1][:200]}')


@cache
def right_hash() -> str:
    """Return the hash of the run that is harmed, from one that is not."""
    with TemporaryDirectory() as folder:
        ended = subprocess.run(
            [*KHR, 'run', SCENARIO, '--offline', '--duration', str(SECONDS), '--out', folder],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    return ended.stdout.split()[-1]
