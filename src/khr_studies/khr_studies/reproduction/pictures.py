"""Draw the figures and stability maps of a reproduction on a pool of workers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from khr_common import KhrError
from khr_studies.measuring.experiments import folder_of, root_of, runs_by_name
from khr_studies.reproduction.experiment_plan import ExperimentPlan, engine_option
from khr_studies.reproduction.results import FigureResult
from khr_studies.stability_map.files import draw_map
from khr_studies.thesis_figures.registry import FIGURES, draw, paths
from khr_sweeps.pool import Pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.specification import Sweep


@dataclass(eq=False)
class Pictures:
    """Figures drawn by a pool of workers; a failed figure does not stop the others.

    Attributes:
        pool: its workers must have access to the same folders.
        bar: advances with each figure.
        out: folder of the figures and their CSV files.
        plan: form and physics engine of the runs.
    """

    pool: Pool
    bar: ProgressBar
    out: Path
    plan: ExperimentPlan

    def __post_init__(self) -> None:
        self._futures: dict[str, tuple[FigureResult, Any]] = {}

    def submit_figure(self, number: str) -> None:
        """Start drawing a figure."""
        drawing, fast, engine = FIGURES[number], self.plan.fast, self.plan.engine
        result = FigureResult(
            number,
            drawing.title,
            *paths(number, self.out, engine),
            f'khr figure {number}' + ' --fast' * fast + engine_option(engine),
            drawing.experiments,
        )
        self._submit(result, _draw_figure, number, self.out.absolute(), fast, engine)

    def submit_map(self, sweep: Sweep) -> None:
        """Start drawing a stability map over the first two axes of an experiment."""
        x, y = list(sweep.axes)[:2]
        name, image = sweep.name, self.out / f'{sweep.name}.png'
        folder = folder_of(name, self.plan.fast, root_of(self.plan.engine))
        result = FigureResult(
            name,
            sweep.title,
            image,
            image.with_suffix('.csv'),
            f'khr map {folder} --x {x} --y {y}',
            (name,),
        )
        self._submit(result, draw_map, folder.absolute(), x, y, image.absolute())

    def results(self, numbers: Iterable[str]) -> list[FigureResult]:
        """Wait for the figures with these numbers; return them in this order."""
        return [self._result(number) for number in numbers]

    def _submit(
        self, result: FigureResult, function: Callable[..., object], *arguments: Any
    ) -> None:
        for path in (result.image, result.points):
            path.unlink(missing_ok=True)  # files of an earlier reproduction
        future = self.pool.submit(function, *arguments)
        future.add_done_callback(lambda _: self.bar.advance())
        self._futures[result.number] = result, future

    def _result(self, number: str) -> FigureResult:
        result, future = self._futures[number]
        try:
            future.result()
        except Exception as failure:  # of the drawing or its worker
            return replace(result, error=error_line(failure))
        return result


def error_line(error: Exception) -> str:
    """Format an error as one line; user errors are shown without their type."""
    text = ' '.join(str(error).split())
    return text if isinstance(error, KhrError) else f'{type(error).__name__}: {text}'


def _draw_figure(number: str, out: Path, fast: bool, engine: str) -> None:
    runs = runs_by_name(FIGURES[number].experiments, root_of(engine), fast)
    draw(number, out, runs, fast, engine=engine)
