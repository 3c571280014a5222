"""How long whole commands take: ``python -m tests.benchmarks.bench_commands``."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from khr_common import RunError
from tests import ROOT
from tests.benchmarks.clock import log


class Command(NamedTuple):
    """A command, the wall time that it should take at most on two cores, s, and its words."""

    name: str
    most: float
    words: tuple[str, ...]


_KHR = (sys.executable, '-m', 'khr.cli.command', 'reproduce')
# In this order in one folder: the first installs what the others use.
COMMANDS = (
    Command('make run', 60.0, ('make', '-C', 'clone', 'run')),
    Command('make test', 480.0, ('make', '-C', 'clone', 'test')),
    Command('make quick', 60.0, ('make', '-C', 'clone', 'quick')),
    Command(
        'khr reproduce --fast --engine mujoco',
        75.0,
        (*_KHR, '--fast', '--engine', 'mujoco', '--out', 'fast'),
    ),
    Command('khr reproduce --engine mujoco', 600.0, (*_KHR, '--engine', 'mujoco', '--out', 'all')),
)


def measure() -> dict[str, float]:
    """Return the wall time of each command, s; those of make in a clone of the last commit.

    Raises:
        RunError: if one fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(['git', 'clone', '--quiet', ROOT, 'clone'], cwd=folder, check=True)
        # Nothing was downloaded before.
        empty = {'UV_CACHE_DIR': str(Path(folder) / 'cache'), 'PIP_NO_CACHE_DIR': '1'}
        return {command.name: _measure(command, folder, empty) for command in COMMANDS}


def _measure(command: Command, folder: str, environment: dict[str, str]) -> float:
    log(command.name)
    with tempfile.NamedTemporaryFile(delete=False) as said:
        began = time.perf_counter()
        code = subprocess.run(
            command.words,
            cwd=folder,
            env={**os.environ, **environment},
            stdout=said,
            stderr=said,
            check=False,
        ).returncode
        seconds = time.perf_counter() - began
    if code:
        raise RunError(f'{command.name} ended with {code}; what it said is in {said.name}')
    Path(said.name).unlink()
    return seconds


def main() -> None:
    """Measure and print."""
    for name, seconds in measure().items():
        print(f'{seconds:8.1f} s  {name}')


if __name__ == '__main__':
    main()
