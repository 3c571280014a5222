"""``khr reproduce``: every experiment, figure and row of the thesis anew, on one page."""

from __future__ import annotations

import os
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import timedelta
from importlib.metadata import version as version_of
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING

from khr_bringup import experiments
from khr_bringup.critical import limit_of_seed
from khr_bringup.errors import BringupError
from khr_bringup.experiments import ROOT, Opened, folder_of, runs_of, shipped
from khr_bringup.figures import FIGURES, draw, drawing_of
from khr_bringup.jobs import KeptJobs
from khr_bringup.pictures import Pictures, reason, runs_by_name
from khr_bringup.progress import Bar
from khr_bringup.reproduction import FigureResult, Reproduction
from khr_bringup.scoreboard import ask_all, board
from khr_bringup.scoreboard_runs import Bench
from khr_bringup.sweeps import INTERRUPTED, check_workers, tell_lost
from khr_bringup.sweeps.version import code_version

if TYPE_CHECKING:
    from distributed import Client

SCOREBOARD = 'scoreboard'
MAP = 'map_'  # what the names of experiments begin with that are drawn as stability maps
SEEDS, TOLERANCE = 3, 0.2  # of the scoreboard; the tolerance is that of each bisection, in deg
FAST_SEEDS, FAST_TOLERANCE = 1, 0.8
LIMIT_RUNS = 5  # that a bisection takes, about
# What decides the scoreboard's measurements beside the runs themselves.
MEASURING = (('khr_analysis', '**/*.py'), ('khr_bringup', 'critical.py'),
             ('khr_bringup', 'scoreboard_runs.py'))
LIBRARIES = ('numpy', 'scipy', 'pybullet', 'matplotlib')


@dataclass(frozen=True)
class Wanted:
    """What is to be reproduced.

    Attributes:
        figures: their numbers, in the order of the registry.
        maps: names of experiments that are drawn as stability maps.
        scoreboard: whether the scoreboard is measured.
        fast: whether everything is taken in its quick and coarse form.
    """

    figures: tuple[str, ...]
    maps: tuple[str, ...]
    scoreboard: bool
    fast: bool

    @property
    def experiments(self) -> tuple[str, ...]:
        """Return the names of all experiments that this needs, each once."""
        of_figures = (name for number in self.figures for name in FIGURES[number].experiments)
        return tuple(dict.fromkeys((*of_figures, *self.maps)))


def wanted(only: str | None, fast: bool) -> Wanted:
    """Read what is to be reproduced: everything, or what a list with commas names.

    Raises:
        BringupError: if a name is not known; the text lists those there are.
    """
    maps = [name for name in shipped() if name.startswith(MAP)]
    every = (*FIGURES, *maps, SCOREBOARD)
    names = every if only is None else tuple(name.strip() for name in only.split(','))
    for name in names:
        if name not in every:
            raise BringupError(f'--only: {name!r} is not known; accepted: {", ".join(every)}')
    return Wanted(tuple(number for number in FIGURES if number in names),
                  tuple(name for name in maps if name in names), SCOREBOARD in names, fast)


def reproduce(out: Path, only: str | None = None, fast: bool = False,
              workers: int | None = None) -> int:
    """Reproduce the thesis, or a part of it; return the exit code.

    What has been computed before is not computed again.

    Args:
        out: folder of the page.
        only: figures, maps and ``scoreboard``, with commas; everything if left out.
        fast: whether to take the quick and coarse form.
        workers: processes; as many as there are cores by default.

    Raises:
        BringupError: if an argument is not accepted or something cannot be written.
        RunError: if the computation could not go on; what is finished is kept.
    """
    from khr_bringup.page.index import write_index

    check_workers(workers)
    began = time.monotonic()
    asked = wanted(only, fast)
    command = ' '.join(('khr reproduce', *(['--only', only] if only else []),
                        *(['--fast'] if fast else [])))
    _make(out / 'figures')
    try:
        with experiments.opened(asked.experiments, fast) as sweeps:
            found = _compute(asked, sweeps, out / 'figures', workers or os.cpu_count() or 1)
    except KeyboardInterrupt:
        print('khr: interrupted; repeat the command to go on', file=sys.stderr)
        return INTERRUPTED
    drawn = [result for result in found.drawn if result.number in FIGURES]
    contents = Reproduction(
        drawn, *found.scoreboard, [result for result in found.drawn if result not in drawn],
        {name: runs_of(folder_of(name, fast)) for name in asked.experiments},
        {specification.name: specification.seeds or 0 for specification, _ in sweeps},
        time.monotonic() - began, fast, _versions(), command)
    page = write_index(out, contents)
    failed = [result for result in found.drawn if result.error]
    for result in failed:
        print(f'khr: {result.number}: {result.error}', file=sys.stderr)
    if found.lost:
        tell_lost(found.lost)
    took = timedelta(seconds=round(time.monotonic() - began))
    runs = sum(map(len, contents.runs.values()))
    print(f'{page}: {len(found.drawn) - len(failed)} of {len(found.drawn)} figures from {runs} '
          f'runs; {contents.scoreboard_summary or "no scoreboard"}; {took}')
    return 1 if failed or found.lost or found.failed else 0


def figure(number: str, out: Path, fast: bool) -> list[Path]:
    """Draw one figure from its models, or from its experiments, which are run first.

    Raises:
        KhrError: if there is no such figure, or it cannot be drawn or written.
    """
    needed = drawing_of(number).experiments
    lost = experiments.run(needed, fast, os.cpu_count() or 1) if needed else 0
    if lost:
        tell_lost(lost)
    return draw(number, out, runs_by_name(needed, ROOT, fast), fast)


@dataclass
class Found:
    """What the computations have come to.

    Attributes:
        drawn: figures, then maps.
        scoreboard: its page and its summary.
        lost: number of runs whose workers died.
        failed: whether the scoreboard could not be measured.
    """

    drawn: list[FigureResult]
    scoreboard: tuple[str, str]
    lost: int
    failed: bool


def _compute(asked: Wanted, sweeps: list[Opened], out: Path, workers: int) -> Found:
    """Compute everything on one cluster; what nothing else waits for is handed out first."""
    from khr_bringup.sweeps.cluster import connected

    missing = experiments.missing(sweeps)
    drawn = (*asked.figures, *asked.maps)
    with ExitStack() as stack:
        bar = stack.enter_context(Bar('reproduce', missing + len(drawn), lines=True))
        client = stack.enter_context(connected(workers))
        bench = _bench(client, bar, asked.fast) if asked.scoreboard else None
        pictures = Pictures(client, bar, out, asked.fast)
        for number in asked.figures:
            if not FIGURES[number].experiments:
                pictures.ask_figure(number)
        if bench:
            ask_all(bench)
        lost = experiments.run_on(client, sweeps, bar)
        for number in asked.figures:
            if FIGURES[number].experiments:
                pictures.ask_figure(number)
        for specification, _ in sweeps:
            if specification.name in asked.maps:
                pictures.ask_map(specification)
        scoreboard, failed = ('', ''), False
        if bench:
            try:
                scoreboard = board(bench, explain=not asked.fast)
            except Exception as error:  # it must not stop the rest
                scoreboard, failed = ('', f'no scoreboard: {reason(error)}'), True
        return Found(pictures.results(drawn), scoreboard, lost, failed)


def _bench(client: Client, bar: Bar, fast: bool) -> Bench:
    pool = KeptJobs(client, ROOT / SCOREBOARD, code_version(*MEASURING), bar,
                    {limit_of_seed: LIMIT_RUNS})
    return Bench(pool, FAST_SEEDS if fast else SEEDS, FAST_TOLERANCE if fast else TOLERANCE)


def _versions() -> dict[str, str]:
    return {'code': code_version(), 'Python': python_version(),
            **{name: version_of(name) for name in LIBRARIES}}


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BringupError(f'--out: {str(folder)!r}: {error.strerror}; accepted: a folder that '
                           'can be written') from error
