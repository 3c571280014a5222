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
COMMANDS = (
    Command('khr reproduce --fast --engine mujoco', 75.0, (*_KHR, '--fast', '--engine', 'mujoco')),
    Command('khr reproduce --engine mujoco', 600.0, (*_KHR, '--engine', 'mujoco')),
    Command('make test', 480.0, ('make', '-C', str(ROOT), 'test')),
)


def measure() -> dict[str, float]:
    """Return the wall time of each command in an empty folder, s.

    Raises:
        RunError: if one fails.
    """
    found = {}
    for command in COMMANDS:
        log(command.name)
        with tempfile.TemporaryDirectory() as folder, (Path(folder) / 'log').open('wb') as said:
            began = time.perf_counter()
            code = subprocess.run(
                command.words, cwd=folder, stdout=said, stderr=said, check=False
            ).returncode
            found[command.name] = time.perf_counter() - began
            if code:
                kept = Path(tempfile.mkdtemp()) / 'log'
                os.replace(said.name, kept)
                raise RunError(f'{command.name} ended with {code}; what it said is in {kept}')
    return found


def main() -> None:
    """Measure and print."""
    for name, seconds in measure().items():
        print(f'{seconds:8.1f} s  {name}')


if __name__ == '__main__':
    main()
