"""``khr reproduce``: compute every experiment, figure and row of the thesis, on one page."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version as version_of
from pathlib import Path
from platform import python_version
from typing import TYPE_CHECKING, TypeVar

from khr_bringup.code_version import code_version, library_versions
from khr_common.files import write_text
from khr_experiments import experiments
from khr_experiments.best_gain import map_result
from khr_experiments.consistency import Said, check, ragged, said_of_runs
from khr_experiments.critical import limit_of_seed
from khr_experiments.ensemble_file import read_ensemble, spread_of
from khr_experiments.experiments import ROOT, Opened, Runs
from khr_experiments.findings import (
    Findings,
    compare_friction,
    compare_soles,
    compare_tilting,
    finished,
)
from khr_experiments.job_cache import KeptJobs
from khr_experiments.json_file import write_json
from khr_experiments.peak_origin import PeakStudy, study
from khr_experiments.scoreboard import compare, submit_all
from khr_experiments.scoreboard_rows import Scoreboard
from khr_experiments.scoreboard_runs import Bench
from khr_figures.registry import FIGURES, draw, drawing_of, numbers_of
from khr_report.findings_page import findings_markdown
from khr_report.folders import make_folder
from khr_report.page.text import count, duration
from khr_report.pictures import Pictures, reason, runs_by_name
from khr_report.reproduction import FigureResult, Reproduction, distinct
from khr_report.reproduction_page import write_index
from khr_report.scoreboard_page import summary, write_scoreboard
from khr_report.wanted import SCOREBOARD, Wanted, wanted
from khr_sim import engines
from khr_sweeps.progress import Bar
from khr_sweeps.sweep import INTERRUPTED, check_workers, report_lost

if TYPE_CHECKING:
    from distributed import Client

LINES = 'lines'  # the experiment on the origin of the spectral peaks
SEEDS, TOLERANCE = 3, 0.2  # of the scoreboard; the tolerance is that of each bisection, in deg
FAST_SEEDS, FAST_TOLERANCE, FAST_CURVE = 1, 0.8, (0.0, 3.0, 6.0)
LIMIT_RUNS = 5  # of a bisection, about
# The code that decides the scoreboard's measurements, beside that of the runs.
MEASURING = (
    ('khr_analysis', '**/*.py'),
    ('khr_experiments', 'condition.py'),
    ('khr_experiments', 'critical.py'),
    ('khr_experiments', 'scoreboard_runs.py'),
)
LIBRARIES = ('scipy', 'matplotlib')

Result = TypeVar('Result')


def reproduce(
    out: Path,
    only: str | None = None,
    fast: bool = False,
    workers: int | None = None,
    findings: Path | None = None,
    engine: str = engines.DEFAULT,
) -> int:
    """Reproduce the thesis, or a part of it; return the exit code.

    Results of earlier computations are used again.

    Args:
        out: folder of the page.
        only: figures, maps and ``scoreboard``, with commas; everything if left out.
        fast: whether to compute the quick and coarse form.
        workers: processes; as many as there are cores by default.
        findings: file of the findings; ``findings.md`` in the folder by default.
        engine: physics engine; the results of each are kept apart.

    Raises:
        ReportError: if an argument is not accepted or something cannot be written.
        RunError: if the computation could not go on, or results contradict one another; what is
            finished is kept.
    """
    check_workers(workers)
    began = time.monotonic()
    asked = wanted(only, fast, engine)
    make_folder(out / 'figures')
    try:
        with experiments.opened(experiments.sweeps_of(asked.experiments, fast, engine)) as sweeps:
            computed = _compute(asked, sweeps, out / 'figures', workers or os.cpu_count() or 1)
    except KeyboardInterrupt:
        print('khr: interrupted; repeat the command to go on', file=sys.stderr)
        return INTERRUPTED
    results = _results(asked, computed, began)
    page = _write(out, findings or out / 'findings.md', results)
    failed = [
        *computed.failed,
        *(f'{each.number}: {each.error}' for each in computed.drawn if each.error),
    ]
    for text in failed:
        print(f'khr: {text}', file=sys.stderr)
    report_lost(computed.lost)
    drawn = sum(not each.error for each in computed.drawn)
    print(
        f'{page}: {drawn} of {len(computed.drawn)} figures, {count(results.findings.runs, "run")}, '
        f'scoreboard: {summary(computed.scoreboard) if computed.scoreboard else "not asked for"}; '
        f'{duration(results.seconds)}'
    )
    return 1 if failed or computed.lost else 0


def figures(
    asked: Sequence[str], out: Path, fast: bool, signal: str | None = None
) -> Iterator[Path]:
    """Draw figures from their models, or from their experiments, which are run first.

    Args:
        asked: as :func:`khr_figures.registry.numbers_of` takes it.
        out: folder of the PNG and CSV files.
        fast: whether to use the quick form of the experiments.
        signal: the pitch rate to show of runs, as :func:`khr_figures.registry.draw` takes it.

    Yields:
        The files, as they are written.

    Raises:
        KhrError: if there is no such figure, or one cannot be drawn or written.
    """
    numbers = numbers_of(asked)
    needed = tuple(dict.fromkeys(x for number in numbers for x in drawing_of(number).experiments))
    experiments.run(experiments.sweeps_of(needed, fast), os.cpu_count() or 1)
    for number in numbers:
        runs = runs_by_name(drawing_of(number).experiments, ROOT, fast)
        yield from draw(number, out, runs, fast, signal)


@dataclass
class Computed:
    """What the workers have computed.

    Attributes:
        drawn: figures, then maps.
        scoreboard: None if it was not asked for, or failed.
        seeds: by experiment.
        bisected: experiments whose runs lie along a limit.
        lost: number of runs whose workers died.
        failed: other failures, a line each.
        said: what the scoreboard's measurements say of who stays up.
    """

    drawn: list[FigureResult]
    scoreboard: Scoreboard | None
    seeds: dict[str, int]
    bisected: tuple[str, ...]
    lost: int
    failed: list[str]
    said: list[Said] = field(default_factory=list)

    def attempt(self, name: str, evaluate: Callable[[], Result]) -> Result | None:
        """Return the result of an evaluation; None if it fails, and note the failure."""
        try:
            return evaluate()
        except Exception as error:  # the page is written in any case
            self.failed.append(f'{name}: {reason(error)}')
            return None


def _compute(asked: Wanted, sweeps: list[Opened], out: Path, workers: int) -> Computed:
    """Compute everything on one cluster; jobs that wait for nothing are submitted first."""
    from khr_sweeps.cluster import connected

    drawn = (*asked.figures, *asked.maps)
    with (
        Bar('reproduce', experiments.missing(sweeps) + len(drawn), lines=True) as bar,
        connected(workers) as client,
    ):
        pictures = Pictures(client, bar, out, asked.fast, experiments.root_of(asked.engine))
        for number in asked.figures:
            if not FIGURES[number].experiments:
                pictures.submit_figure(number)
        bench = _bench(client, bar, asked)
        if asked.scoreboard:
            submit_all(bench, explain=not asked.fast)
        lost = experiments.run_on(client, sweeps, bar)
        for number in asked.figures:
            if FIGURES[number].experiments:
                pictures.submit_figure(number)
        for sweep, _ in sweeps:
            if sweep.name in asked.maps:
                pictures.submit_map(sweep)
        computed = Computed(
            [],
            None,
            {each.name: each.seeds or 0 for each, _ in sweeps},
            tuple(each.name for each, _ in sweeps if each.bisect),
            lost,
            [],
        )
        if asked.scoreboard:
            computed.scoreboard = computed.attempt(
                SCOREBOARD, lambda: compare(bench, explain=not asked.fast)
            )
        if computed.scoreboard:
            computed.said = list(bench.said())
        computed.drawn = pictures.results(drawn)
        return computed


def _results(asked: Wanted, computed: Computed, began: float) -> Reproduction:
    root = experiments.root_of(asked.engine)
    runs = runs_by_name(asked.experiments, root, asked.fast)
    peaks = computed.attempt(LINES, lambda: study(runs[LINES])) if LINES in runs else None
    said = [*computed.said, *said_of_runs(runs)]
    check(said, root)
    return Reproduction(
        [each for each in computed.drawn if each.number in FIGURES],
        [each for each in computed.drawn if each.number not in FIGURES],
        runs,
        computed.seeds,
        time.monotonic() - began,
        _findings(asked, computed, runs, peaks),
        peaks,
        ragged(said),
    )


def _findings(
    asked: Wanted, computed: Computed, runs: Mapping[str, Runs], peaks: PeakStudy | None
) -> Findings:
    done, made = finished(runs), distinct(runs)
    maps = {
        name: computed.attempt(name, partial(map_result, runs[name], name in computed.bisected))
        for name in asked.maps
        if runs[name]
    }
    return Findings(
        computed.scoreboard,
        compare_soles(done),
        compare_friction(done),
        compare_tilting(done),
        peaks.origins if peaks else (),
        {name: result for name, result in maps.items() if result is not None},
        sum(each.number in FIGURES for each in computed.drawn),
        len(made),
        float(sum(row['wall_time_s'] for row in made)),
        asked.fast,
        asked.command,
        _versions(),
    )


def _write(out: Path, findings: Path, results: Reproduction) -> Path:
    """Write findings, scoreboard and page; return the path of the page."""
    write_json(findings.with_suffix('.json'), results.findings)
    write_text(findings, findings_markdown(results.findings))
    if results.findings.scoreboard:
        write_scoreboard(out / 'scoreboard.md', results.findings.scoreboard)
    return write_index(out, results)


def _bench(client: Client, bar: Bar, asked: Wanted) -> Bench:
    pool = KeptJobs(
        client,
        experiments.root_of(asked.engine) / SCOREBOARD,
        code_version(*MEASURING),
        bar,
        {limit_of_seed: LIMIT_RUNS},
    )
    spread = spread_of(read_ensemble())
    settings = (
        ((('simulator', 'engine'), asked.engine),) if asked.engine != engines.DEFAULT else ()
    )
    return (
        Bench(pool, FAST_SEEDS, FAST_TOLERANCE, FAST_CURVE, spread, settings)
        if asked.fast
        else Bench(pool, SEEDS, TOLERANCE, spread=spread, settings=settings)
    )


def _versions() -> dict[str, str]:
    return {
        'code': code_version(),
        'Python': python_version(),
        **library_versions(),
        **{name: version_of(name) for name in LIBRARIES},
    }
