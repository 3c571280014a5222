"""``khr reproduce``: every experiment, figure and row of the thesis anew, on one page."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version as version_of
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING

from khr_bringup.code_version import code_version
from khr_common.files import write_text
from khr_experiments import experiments
from khr_experiments.best_gain import map_markdown
from khr_experiments.critical import limit_of_seed
from khr_experiments.experiments import ROOT, Opened, Runs, shipped
from khr_experiments.job_cache import KeptJobs
from khr_experiments.progress import Bar
from khr_experiments.scoreboard import ask_all, board
from khr_experiments.scoreboard_runs import Bench
from khr_experiments.sweeps import INTERRUPTED, check_workers, tell_lost
from khr_report.errors import ReportError
from khr_report.figures import FIGURES, draw, drawing_of
from khr_report.page.text import duration
from khr_report.peak_origin_report import lines_markdown
from khr_report.pictures import Pictures, reason, runs_by_name
from khr_report.reproduction import FigureResult, Reproduction
from khr_sim import engines

if TYPE_CHECKING:
    from distributed import Client

SCOREBOARD = 'scoreboard'
LINES = 'lines'  # the experiment that the origin of the spectral lines is told from
MAP = 'map_'  # what the names of experiments begin with that are drawn as stability maps
SEEDS, TOLERANCE = 3, 0.2  # of the scoreboard; the tolerance is that of each bisection, in deg
FAST_SEEDS, FAST_TOLERANCE, FAST_CURVE = 1, 0.8, (0.0, 3.0, 6.0)
LIMIT_RUNS = 5  # that a bisection takes, about
# What decides the scoreboard's measurements beside the runs themselves.
MEASURING = (
    ('khr_analysis', '**/*.py'),
    ('khr_experiments', 'critical.py'),
    ('khr_experiments', 'scoreboard_runs.py'),
)
LIBRARIES = ('numpy', 'scipy', *engines.LIBRARIES, 'matplotlib')


@dataclass(frozen=True)
class Wanted:
    """What is to be reproduced.

    Attributes:
        figures: their numbers, in the order of the registry.
        maps: names of experiments that are drawn as stability maps.
        scoreboard: whether the scoreboard is measured.
        fast: whether everything is taken in its quick and coarse form.
        command: asks for the same.
    """

    figures: tuple[str, ...]
    maps: tuple[str, ...]
    scoreboard: bool
    fast: bool
    command: str

    @property
    def experiments(self) -> tuple[str, ...]:
        """Return the names of all experiments that this needs, each once."""
        of_figures = (name for number in self.figures for name in FIGURES[number].experiments)
        return tuple(dict.fromkeys((*of_figures, *self.maps)))


def wanted(only: str | None, fast: bool) -> Wanted:
    """Read what is to be reproduced: everything, or what a list with commas names.

    Raises:
        ReportError: if a name is not known; the text lists those there are.
    """
    maps = [name for name in shipped() if name.startswith(MAP)]
    every = (*FIGURES, *maps, SCOREBOARD)
    names = every if only is None else tuple(name.strip() for name in only.split(','))
    for name in names:
        if name not in every:
            raise ReportError(f'--only: {name!r} is not known; accepted: {", ".join(every)}')
    return Wanted(
        tuple(number for number in FIGURES if number in names),
        tuple(name for name in maps if name in names),
        SCOREBOARD in names,
        fast,
        'khr reproduce' + (f' --only {only}' if only else '') + ' --fast' * fast,
    )


def reproduce(
    out: Path,
    only: str | None = None,
    fast: bool = False,
    workers: int | None = None,
    findings: Path | None = None,
) -> int:
    """Reproduce the thesis, or a part of it; return the exit code.

    What has been computed before is not computed again.

    Args:
        out: folder of the page.
        only: figures, maps and ``scoreboard``, with commas; everything if left out.
        fast: whether to take the quick and coarse form.
        workers: processes; as many as there are cores by default.
        findings: file of the findings; ``findings.md`` in the folder by default.

    Raises:
        ReportError: if an argument is not accepted or something cannot be written.
        RunError: if the computation could not go on; what is finished is kept.
    """
    check_workers(workers)
    began = time.monotonic()
    asked = wanted(only, fast)
    _make(out / 'figures')
    try:
        with experiments.opened(experiments.sweeps_of(asked.experiments, fast)) as sweeps:
            found = _compute(asked, sweeps, out / 'figures', workers or os.cpu_count() or 1)
    except KeyboardInterrupt:
        print('khr: interrupted; repeat the command to go on', file=sys.stderr)
        return INTERRUPTED
    contents = _contents(asked, found, began)
    page = _write(out, findings or out / 'findings.md', contents)
    failed = [
        *found.failed,
        *(f'{each.number}: {each.error}' for each in found.drawn if each.error),
    ]
    for text in failed:
        print(f'khr: {text}', file=sys.stderr)
    if found.lost:
        tell_lost(found.lost)
    drawn = sum(not each.error for each in found.drawn)
    print(
        f'{page}: {drawn} of {len(found.drawn)} figures, '
        f'{len(contents.made)} runs, scoreboard: '
        f'{contents.scoreboard_summary or "not asked for"}; {duration(contents.seconds)}'
    )
    return 1 if failed or found.lost else 0


def figure(number: str, out: Path, fast: bool) -> list[Path]:
    """Draw one figure from its models, or from its experiments, which are run first.

    Raises:
        KhrError: if there is no such figure, or it cannot be drawn or written.
    """
    needed = drawing_of(number).experiments
    if lost := experiments.run(experiments.sweeps_of(needed, fast), os.cpu_count() or 1):
        tell_lost(lost)
    return draw(number, out, runs_by_name(needed, ROOT, fast), fast)


@dataclass
class Computed:
    """What the computations have come to.

    Attributes:
        drawn: figures, then maps.
        scoreboard: its page and its summary.
        seeds: by experiment.
        lost: number of runs whose workers died.
        failed: what else went wrong, a line each.
    """

    drawn: list[FigureResult]
    scoreboard: tuple[str, str]
    seeds: dict[str, int]
    lost: int
    failed: list[str]


def _compute(asked: Wanted, sweeps: list[Opened], out: Path, workers: int) -> Computed:
    """Compute everything on one cluster; what waits for nothing is handed out first."""
    from khr_experiments.sweeps.cluster import connected

    drawn = (*asked.figures, *asked.maps)
    with (
        Bar('reproduce', experiments.missing(sweeps) + len(drawn), lines=True) as bar,
        connected(workers) as client,
    ):
        pictures = Pictures(client, bar, out, asked.fast)
        for number in asked.figures:
            if not FIGURES[number].experiments:
                pictures.ask_figure(number)
        bench = _bench(client, bar, asked.fast)
        if asked.scoreboard:
            ask_all(bench)
        lost = experiments.run_on(client, sweeps, bar)
        for number in asked.figures:
            if FIGURES[number].experiments:
                pictures.ask_figure(number)
        for specification, _ in sweeps:
            if specification.name in asked.maps:
                pictures.ask_map(specification)
        scoreboard, failed = _board(bench, asked) if asked.scoreboard else (('', ''), [])
        return Computed(
            pictures.results(drawn),
            scoreboard,
            {each.name: each.seeds or 0 for each, _ in sweeps},
            lost,
            failed,
        )


def _board(bench: Bench, asked: Wanted) -> tuple[tuple[str, str], list[str]]:
    """Return the scoreboard, and why there is none."""
    try:
        return board(bench, explain=not asked.fast), []
    except Exception as error:  # whatever is wrong with it, the figures are drawn
        return ('', ''), [f'{SCOREBOARD}: {reason(error)}']


def _contents(asked: Wanted, found: Computed, began: float) -> Reproduction:
    runs = runs_by_name(asked.experiments, ROOT, asked.fast)
    lines = _told(lines_markdown, LINES, runs[LINES], found) if LINES in runs else ''
    return Reproduction(
        [each for each in found.drawn if each.number in FIGURES],
        *found.scoreboard,
        [each for each in found.drawn if each.number not in FIGURES],
        runs,
        found.seeds,
        time.monotonic() - began,
        asked.fast,
        _versions(),
        asked.command,
        lines,
        {name: _told(map_markdown, name, runs[name], found) for name in asked.maps if runs[name]},
    )


def _told(tell: Callable[[Runs], str], name: str, runs: Runs, found: Computed) -> str:
    """Return what runs tell; nothing, and why, if that fails."""
    try:
        return tell(runs)
    except Exception as error:  # whatever is wrong with it, the page is written
        found.failed.append(f'{name}: {reason(error)}')
        return ''


def _write(out: Path, findings: Path, contents: Reproduction) -> Path:
    """Write findings, scoreboard and page; return the page."""
    from khr_report.page.findings import findings as tell
    from khr_report.page.index import write_index

    try:
        findings.parent.mkdir(parents=True, exist_ok=True)
        write_text(findings, tell(contents))
        if contents.scoreboard:
            write_text(out / 'scoreboard.md', contents.scoreboard)
    except OSError as error:
        raise ReportError(
            f'{error.filename}: {error.strerror}; accepted: files that can be '
            'written for --out and --findings'
        ) from error
    return write_index(out, contents)


def _bench(client: Client, bar: Bar, fast: bool) -> Bench:
    pool = KeptJobs(
        client, ROOT / SCOREBOARD, code_version(*MEASURING), bar, {limit_of_seed: LIMIT_RUNS}
    )
    return (
        Bench(pool, FAST_SEEDS, FAST_TOLERANCE, FAST_CURVE)
        if fast
        else Bench(pool, SEEDS, TOLERANCE)
    )


def _versions() -> dict[str, str]:
    return {
        'code': code_version(),
        'Python': python_version(),
        **{name: version_of(name) for name in LIBRARIES},
    }


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ReportError(
            f'--out: {str(folder)!r}: {error.strerror}; accepted: a folder that can be written'
        ) from error
