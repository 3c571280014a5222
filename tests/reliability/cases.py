"""The cases of the campaign: each does a run some harm and says what fell short, if anything."""

import random
import shutil
from contextlib import suppress
from pathlib import Path
from tempfile import mkdtemp
from traceback import extract_tb

import psutil

from khr_bringup.graph.run_registry import running
from tests.reliability.harms import files, load, machine, processes, studies
from tests.reliability.harms.harmed_run import FIGURES, Case

LONGEST_LINE = 600
HARMS = {**processes.HARMS, **machine.HARMS, **files.HARMS, **studies.HARMS, **load.HARMS}


def cases(seed: int, kills: int, soak_seconds: int) -> list[Case]:
    """Return all cases of a campaign, in an order that the seed decides."""
    found = [
        *processes.cases(seed, kills),
        *machine.cases(seed),
        *files.cases(seed),
        *studies.cases(seed),
        *load.cases(seed, soak_seconds),
    ]
    random.Random(seed).shuffle(found)
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
        where = extract_tb(error.__traceback__)[-1]
        faults = [f'campaign: {where.name}, line {where.lineno}: {type(error).__name__}: {error}']
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    return [' '.join(fault.split())[:LONGEST_LINE] for fault in faults + left_over()], figures


def left_over() -> list[str]:
    """Return what dead runs have left: entries of the register, locked or not, and segments."""
    dead = [entry.scenario for entry in running() if not psutil.pid_exists(entry.pid)]
    return [f'an entry of {name}' for name in dead]
