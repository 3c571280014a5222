"""``khr reproduce``: compute all experiments, figures and rows of the thesis."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version as version_of
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from khr_bringup.code_version import code_version, versions_of_run
from khr_report.output import make_folder
from khr_sim.physics import engines
from khr_studies.measuring import experiments
from khr_studies.measuring.bench import Bench
from khr_studies.measuring.condition import with_engine
from khr_studies.measuring.consistency import check, experiment_runs, ragged_limits
from khr_studies.measuring.critical import limit_of_seed
from khr_studies.measuring.ensemble_file import read_ensemble, spread_of
from khr_studies.measuring.experiments import OpenSweep, Runs, runs_by_name
from khr_studies.measuring.kept_pool import version_of_study
from khr_studies.measuring.run_table import run_table
from khr_studies.measuring.thesis_values import STAGE_1_GRID
from khr_studies.peak_origin.study import LINE_11, PeakStudy, measure_line_11, study
from khr_studies.reproduction.experiment_plan import SCOREBOARD, ExperimentPlan
from khr_studies.reproduction.findings import (
    Findings,
    compare_friction,
    compare_soles,
    compare_tilting,
    distinct,
    experiment_table,
)
from khr_studies.reproduction.pictures import (
    FigureResult,
    Started,
    error_line,
    start_figure,
    start_map,
)
from khr_studies.scoreboard.rows import Scoreboard
from khr_studies.scoreboard.study import compare, submit_all
from khr_studies.stability_map.study import INCLINATION, MapResult, map_result
from khr_studies.thesis_figures.registry import FIGURES
from khr_sweeps.pool import check_workers, local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.kept_jobs import KeptJobs
from khr_sweeps.specification import Sweep

LINES = 'lines'  # experiment on the origin of the spectral peaks
# Of the scoreboard: seeds, tolerance of each bisection, deg, inclinations of its curve, deg.
FULL, FAST = (3, 0.2, STAGE_1_GRID), (1, 0.8, (0.0, 3.0, 6.0))
LIMIT_RUNS = 5  # of a bisection, about
LIBRARIES = ('scipy', 'matplotlib')

Result = TypeVar('Result')


@dataclass(frozen=True)
class Reproduction:
    """All results of a reproduction."""

    figures: list[FigureResult]  # in the order of the registry
    maps: list[FigureResult]  # stability maps, by the names of their experiments
    runs: dict[str, Runs]  # by experiment
    seeds: dict[str, int]  # number of seeds by experiment; 0 if it uses the seed of the scenario
    seconds: float  # wall time of the command; stored results took no time
    findings: Findings  # the results as data
    # origin of the spectral peaks; None if it is not in the plan, or failed
    peaks: PeakStudy | None
    # conditions lost below an inclination at which they stay up, a line each
    ragged: Sequence[str] = ()
    failed: Sequence[str] = ()  # failed evaluations, a line each
    lost: int = 0  # number of runs lost with their worker

    @property
    def drawn(self) -> list[FigureResult]:
        """Return figures and maps."""
        return [*self.figures, *self.maps]

    @property
    def failures(self) -> list[str]:
        """Return all failures, of figures too, a line each."""
        errors = (f'{each.number}: {each.error}' for each in self.drawn if each.error)
        return [*self.failed, *errors]


def reproduce(plan: ExperimentPlan, out: Path, workers: int | None = None) -> Reproduction:
    """Reproduce the thesis, or a part of it; stored results are reused.

    The figures go to ``figures`` in the folder of the page.

    Raises:
        RunError: if the computation had to stop, or results contradict one another; finished
            results are kept.
    """
    processes = check_workers(workers)
    began = time.monotonic()
    make_folder(out / 'figures')
    sweeps = experiments.sweeps_of(plan.experiments, plan.fast, plan.engine)
    with experiments.open_sweeps(sweeps) as entered:
        computed = _compute(plan, entered, out / 'figures', processes)
    return _results(plan, list(sweeps.values()), computed, began)


@dataclass
class Computed:
    """The results of the workers."""

    lost: int = 0  # number of runs lost with their worker
    # figures, maps: the drawings
    figures: list[FigureResult] = field(default_factory=list)
    maps: list[FigureResult] = field(default_factory=list)
    scoreboard: Scoreboard | None = None  # None if it is not in the plan, or failed
    failed: list[str] = field(default_factory=list)  # other failures, a line each
    # table of all runs of the scoreboard
    measured: pd.DataFrame = field(default_factory=lambda: run_table(()))

    def attempt(self, name: str, evaluate: Callable[[], Result]) -> Result | None:
        """Return the result of an evaluation; record a failure and return None."""
        try:
            return evaluate()
        except Exception as error:  # the page is written nevertheless
            self.failed.append(f'{name}: {error_line(error)}')
            return None


def _compute(plan: ExperimentPlan, sweeps: list[OpenSweep], out: Path, workers: int) -> Computed:
    """Compute everything on one pool; jobs that depend on no other are submitted first."""
    left = experiments.count_missing(sweeps) + len(plan.figures) + len(plan.maps)
    with (
        ProgressBar('reproduce', left, lines=True) as bar,
        local_pool(workers) as pool,
        KeptJobs(
            pool,
            experiments.root_of(plan.engine) / SCOREBOARD,
            version_of_study(compare.__module__),
            bar,
            {limit_of_seed: LIMIT_RUNS},
        ) as kept,
    ):
        started: dict[str, Started] = {}

        def follow(figure: FigureResult, drawn: Future[Any]) -> None:
            drawn.add_done_callback(lambda _: bar.advance())
            started[figure.number] = figure, drawn

        of_runs = [number for number in plan.figures if FIGURES[number].experiments]
        for number in (each for each in plan.figures if each not in of_runs):
            follow(*start_figure(pool, plan, number, out))
        settings = with_engine(plan.engine) if plan.engine != engines.DEFAULT else ()
        seeds, tolerance, curve = FAST if plan.fast else FULL
        bench = Bench(kept, seeds, tolerance, curve, spread_of(read_ensemble()), settings)
        if plan.scoreboard:
            submit_all(bench, explain=not plan.fast)
        computed = Computed(experiments.run_open(pool, sweeps, bar))
        for number in of_runs:
            follow(*start_figure(pool, plan, number, out))
        for sweep, _ in sweeps:
            if sweep.name in plan.maps:
                follow(*start_map(pool, plan, sweep, out))
        if plan.scoreboard:
            computed.scoreboard = computed.attempt(
                SCOREBOARD, lambda: compare(bench, explain=not plan.fast)
            )
        if computed.scoreboard:
            measured = computed.attempt('table of runs', bench.runs)
            computed.measured = computed.measured if measured is None else measured
        drawn = {number: figure.after(future) for number, (figure, future) in started.items()}
        computed.figures = [drawn[number] for number in plan.figures]
        computed.maps = [drawn[name] for name in plan.maps]
        return computed


def _results(
    plan: ExperimentPlan, sweeps: list[Sweep], computed: Computed, began: float
) -> Reproduction:
    runs = runs_by_name(plan.experiments, plan.fast, plan.engine)
    peaks = computed.attempt(LINES, lambda: study(runs[LINES])) if LINES in runs else None
    every = pd.concat([computed.measured, experiment_runs(runs)])
    check(every, experiments.root_of(plan.engine))
    return Reproduction(
        computed.figures,
        computed.maps,
        runs,
        {each.name: each.seeds or 0 for each in sweeps},
        time.monotonic() - began,
        _findings(plan, sweeps, computed, runs, peaks),
        peaks,
        ragged_limits(every),
        computed.failed,
        computed.lost,
    )


def _findings(
    plan: ExperimentPlan,
    sweeps: list[Sweep],
    computed: Computed,
    runs: Mapping[str, Runs],
    peaks: PeakStudy | None,
) -> Findings:
    table = experiment_table(runs)
    # The tables of comparisons have no column for the parameters that line 11 varies.
    done = table[table['verdict'].notna() & (table['experiment'] != LINE_11)]
    made = distinct(table)
    maps = {
        each.name: computed.attempt(each.name, partial(_map, table, each))
        for each in sweeps
        if each.name in plan.maps and runs[each.name]
    }
    odd = computed.attempt(LINE_11, lambda: measure_line_11(runs)) if LINE_11 in runs else None
    return Findings(
        computed.scoreboard,
        compare_soles(done),
        compare_friction(done),
        compare_tilting(done),
        peaks.origins if peaks else [],
        odd or [],
        {name: result for name, result in maps.items() if result is not None},
        len(computed.figures),
        len(made),
        float(made['wall_time_s'].sum()),
        plan.fast,
        plan.command,
        {'code': code_version(), **versions_of_run()}
        | {name: version_of(name) for name in LIBRARIES},
    )


def _map(table: pd.DataFrame, sweep: Sweep) -> MapResult:
    name = next(axis for axis in sweep.axes if axis != INCLINATION)
    return map_result(table[table['experiment'] == sweep.name], name, bool(sweep.bisect))
