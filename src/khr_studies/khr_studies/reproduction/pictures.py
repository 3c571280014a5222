"""Draw the figures and stability maps of a reproduction on a pool of workers."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from khr_common.errors import KhrError
from khr_studies.measuring.experiments import folder_of, runs_by_name
from khr_studies.reproduction.experiment_plan import ExperimentPlan, engine_option
from khr_studies.stability_map.page import draw_map
from khr_studies.thesis_figures.registry import FIGURES, draw, paths
from khr_sweeps.pool import Pool
from khr_sweeps.specification import Sweep


@dataclass(frozen=True)
class FigureResult:
    """One figure of a reproduction."""

    number: str  # of the figure in the thesis, or the name of a figure that the thesis lacks
    title: str  # one line
    # image, points: the PNG, and the CSV file of its points; missing after an error
    image: Path
    points: Path
    command: str  # draws the figure
    # names of the experiments shown; empty if it is drawn from models
    experiments: tuple[str, ...]
    error: str = ''  # reason if it could not be drawn, else empty

    def after(self, drawn: Future[Any]) -> FigureResult:
        """Wait for the worker that draws it; an error of it becomes part of the result."""
        try:
            drawn.result()
        except Exception as error:
            return replace(self, error=error_line(error))
        return self


Started = tuple[FigureResult, Future[Any]]  # a figure that a worker is drawing


def start_figure(pool: Pool, plan: ExperimentPlan, number: str, out: Path) -> Started:
    """Start drawing a figure into a folder, to which the workers need access."""
    drawing, fast, engine = FIGURES[number], plan.fast, plan.engine
    figure = FigureResult(
        number,
        drawing.title,
        *paths(number, out, engine),
        f'khr figure {number}' + ' --fast' * fast + engine_option(engine),
        drawing.experiments,
    )
    return _start(pool, figure, _draw_figure, number, out.absolute(), fast, engine)


def start_map(pool: Pool, plan: ExperimentPlan, sweep: Sweep, out: Path) -> Started:
    """Start drawing a stability map over the first two axes of an experiment."""
    x, y = list(sweep.axes)[:2]
    image = out / f'{sweep.name}.png'
    folder = folder_of(sweep.name, plan.fast, plan.engine)
    command = f'khr map {folder} --x {x} --y {y}'
    points = image.with_suffix('.csv')
    figure = FigureResult(sweep.name, sweep.title, image, points, command, (sweep.name,))
    return _start(pool, figure, draw_map, folder.absolute(), x, y, image.absolute())


def error_line(error: Exception) -> str:
    """Format an error as one line; user errors are shown without their type."""
    text = ' '.join(str(error).split())
    return text if isinstance(error, KhrError) else f'{type(error).__name__}: {text}'


def _start(pool: Pool, figure: FigureResult, job: Callable[..., Any], *arguments: Any) -> Started:
    for path in (figure.image, figure.points):
        path.unlink(missing_ok=True)  # files of an earlier reproduction
    return figure, pool.submit(job, *arguments)


def _draw_figure(number: str, out: Path, fast: bool, engine: str) -> None:
    runs = runs_by_name(FIGURES[number].experiments, fast, engine)
    draw(number, out, runs, fast, engine=engine)
