"""The results of a reproduction, from which its page is written."""

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
        number: the thesis's number of the figure, or the name of one that the thesis lacks.
        title: what it shows, in one line.
        image, points: the PNG and the CSV of its points; missing after an error.
        command: the command that draws it again.
        experiments: names of those that it shows; none if it is drawn from models.
        error: why it could not be drawn; empty if it was.
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
        seeds: number of seeds by experiment; 0 if it uses the scenario's own.
        seconds: wall time of the command, without results computed earlier.
        findings: the results as data.
        peaks: origin of the spectral peaks; None if its runs were not asked for, or failed.
        ragged: conditions lost on gentler ground than some on which they stay up, a line each.
        failed: evaluations that failed, a line each.
        lost: number of runs whose workers died.
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
        """Return what failed, figures as well, a line each."""
        errors = (f'{each.number}: {each.error}' for each in self.drawn if each.error)
        return [*self.failed, *errors]
