"""The results of a reproduction, the input of its page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from khr_studies.measuring.experiments import Runs
from khr_studies.peak_origin.study import PeakStudy
from khr_studies.reproduction.findings import Findings


@dataclass(frozen=True)
class FigureResult:
    """One figure of a reproduction.

    Attributes:
        number: of the figure in the thesis, or the name of a figure that the thesis lacks.
        title: one line.
        image, points: the PNG, and the CSV file of its points; missing after an error.
        command: draws the figure.
        experiments: names of the experiments shown; empty if it is drawn from models.
        error: reason if it could not be drawn, else empty.
    """

    number: str
    title: str
    image: Path
    points: Path
    command: str
    experiments: tuple[str, ...]
    error: str = ''


@dataclass(frozen=True)
class Reproduction:
    """All results of a reproduction.

    Attributes:
        figures: in the order of the registry.
        maps: stability maps, by the names of their experiments.
        runs: by experiment.
        seeds: number of seeds by experiment; 0 if it uses the seed of the scenario.
        seconds: wall time of the command; stored results took no time.
        findings: the results as data.
        peaks: origin of the spectral peaks; None if it is not in the plan, or failed.
        ragged: conditions lost below an inclination at which they stay up, a line each.
        failed: failed evaluations, a line each.
        lost: number of runs lost with their worker.
    """

    figures: list[FigureResult]
    maps: list[FigureResult]
    runs: dict[str, Runs]
    seeds: dict[str, int]
    seconds: float
    findings: Findings
    peaks: PeakStudy | None
    ragged: Sequence[str] = ()
    failed: Sequence[str] = ()
    lost: int = 0

    @property
    def drawn(self) -> list[FigureResult]:
        """Return figures and maps."""
        return [*self.figures, *self.maps]

    @property
    def failures(self) -> list[str]:
        """Return all failures, of figures too, a line each."""
        errors = (f'{each.number}: {each.error}' for each in self.drawn if each.error)
        return [*self.failed, *errors]
