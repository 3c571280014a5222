"""What a reproduction of the thesis has found: what its page is written from."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from khr_experiments.experiments import Runs


@dataclass(frozen=True)
class FigureResult:
    """One picture of a reproduction.

    Attributes:
        number: the thesis's number of the figure, or the name of one that the thesis lacks.
        title: what it shows, in one line.
        image, table: the PNG and the CSV with the same numbers; not there after an error.
        command: draws it again.
        experiments: names of those that it shows; none if it is drawn from models.
        seconds: that the drawing took, without the runs, of wall time.
        error: why it could not be drawn; empty if it was.
    """

    number: str
    title: str
    image: Path
    table: Path
    command: str
    experiments: tuple[str, ...]
    seconds: float
    error: str = ''


@dataclass(frozen=True)
class Reproduction:
    """All that a reproduction has found.

    Attributes:
        figures: in the order of the registry.
        scoreboard: the page in Markdown; empty if it was not asked for.
        scoreboard_summary: it in one line.
        maps: stability maps, by the names of their experiments.
        runs: by experiment.
        seeds: number of seeds, by experiment; 0 for one that has its scenario's own.
        seconds: of wall time, of the command; what had been done before is not in it.
        fast: whether it is the quick and coarse form.
        versions: of the code, and of what it rests on.
        command: does it again.
        lines: of the origin of the spectral lines, in Markdown; empty if it was not asked for.
        tables: what the maps tell in numbers, in Markdown, by experiment.
    """

    figures: list[FigureResult]
    scoreboard: str
    scoreboard_summary: str
    maps: list[FigureResult]
    runs: dict[str, Runs]
    seeds: dict[str, int]
    seconds: float
    fast: bool
    versions: dict[str, str]
    command: str
    lines: str = ''
    tables: dict[str, str] = field(default_factory=dict)

    @property
    def made(self) -> list[dict[str, Any]]:
        """Return the rows of all runs; one that several experiments have is there once."""
        rows = (run.row for runs in self.runs.values() for run in runs)
        return list({(row['trajectory_hash'], row['wall_time_s']): row for row in rows}.values())

    @property
    def run_seconds(self) -> float:
        """Return how long all runs took, one after the other, s."""
        return float(sum(row['wall_time_s'] for row in self.made))
