"""Experiments: the sweeps that figures are drawn from, and their finished runs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from khr_bringup.scenario import Scenario
from khr_bringup.series import Series


@dataclass(frozen=True, eq=False)
class Run:
    """One finished run of an experiment.

    Attributes:
        point: the swept values: ``scenario``, ``case``, ``node.parameter``.
        seed: number of the seed; None if the experiment leaves the scenario's own.
        row: what it came to, by column of RESULTS.
        scenario: as it was run.
        kept: where its signals are.
    """

    point: dict[str, Any]
    seed: int | None
    row: dict[str, Any]
    scenario: Scenario
    kept: Path

    @cached_property
    def series(self) -> Series | None:
        """Load the signals; None if the experiment keeps none, or the run could not be made."""
        return Series.load(self.kept) if self.kept.is_file() else None


Runs = list[Run]
