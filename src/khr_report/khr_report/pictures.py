"""Draw the figures and stability maps of a reproduction on the workers of a cluster."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from khr_common import KhrError
from khr_experiments.experiments import ROOT, Runs, folder_of, runs_of
from khr_figures.registry import FIGURES, draw, paths
from khr_figures.stability import draw_map
from khr_report.reproduction import FigureResult
from khr_sweeps.progress import Bar
from khr_sweeps.specification import Sweep

if TYPE_CHECKING:
    from distributed import Client


class Pictures:
    """Figures that the workers of a cluster draw; one that fails does not stop the others.

    Args:
        client: of the cluster, whose workers have access to the same folders.
        bar: advances with each figure.
        out: folder of the figures and their CSV files.
        fast: whether to draw the quick and coarse form.
        root: folder of the experiments.
    """

    def __init__(self, client: Client, bar: Bar, out: Path, fast: bool, root: Path = ROOT) -> None:
        self._client = client
        self._bar = bar
        self._out = out
        self._fast = fast
        self._root = root
        self._futures: dict[str, tuple[FigureResult, Any]] = {}

    def submit_figure(self, number: str) -> None:
        """Start drawing a figure."""
        drawing = FIGURES[number]
        result = FigureResult(
            number,
            drawing.title,
            *paths(number, self._out),
            f'khr figure {number}' + ' --fast' * self._fast,
            drawing.experiments,
            0.0,
        )
        self._submit(
            result, _draw_figure, number, self._out.absolute(), self._root.absolute(), self._fast
        )

    def submit_map(self, sweep: Sweep) -> None:
        """Start drawing a stability map over the first two axes of an experiment."""
        x, y = list(sweep.axes)[:2]
        name = sweep.name
        folder, image = folder_of(name, self._fast, self._root), self._out / f'{name}.png'
        result = FigureResult(
            name,
            sweep.title,
            image,
            image.with_suffix('.csv'),
            f'khr map {folder} --x {x} --y {y}',
            (name,),
            0.0,
        )
        self._submit(result, draw_map, folder.absolute(), x, y, image.absolute())

    def results(self, numbers: Iterable[str]) -> list[FigureResult]:
        """Wait for all; return them in the order of their numbers."""
        return [self._result(number) for number in numbers]

    def _submit(
        self, result: FigureResult, function: Callable[..., object], *arguments: Any
    ) -> None:
        for path in (result.image, result.points):
            path.unlink(missing_ok=True)  # of an earlier reproduction
        future = self._client.submit(
            _timed, function, *arguments, pure=False, priority=1
        )  # first, as some take long
        future.add_done_callback(lambda _: self._bar.advance())
        self._futures[result.number] = result, future

    def _result(self, number: str) -> FigureResult:
        result, future = self._futures[number]
        try:
            seconds, error = future.result()
        except Exception as failure:  # the worker died; the other figures are not affected
            seconds, error = 0.0, reason(failure)
        return replace(result, seconds=seconds, error=error)


def runs_by_name(names: Iterable[str], root: Path, fast: bool) -> dict[str, Runs]:
    """Return the finished runs of experiments."""
    return {name: runs_of(folder_of(name, fast, root)) for name in names}


def reason(error: Exception) -> str:
    """Format an error as one line; user errors are shown without their type."""
    text = ' '.join(str(error).split())
    return text if isinstance(error, KhrError) else f'{type(error).__name__}: {text}'


def _timed(function: Callable[..., object], *arguments: Any) -> tuple[float, str]:
    """Draw; return the wall time in s and the error, empty without one."""
    began = time.monotonic()
    try:
        function(*arguments)
    except Exception as error:  # the other figures are drawn in any case
        return time.monotonic() - began, reason(error)
    return time.monotonic() - began, ''


def _draw_figure(number: str, out: Path, root: Path, fast: bool) -> None:
    draw(number, out, runs_by_name(FIGURES[number].experiments, root, fast), fast)
