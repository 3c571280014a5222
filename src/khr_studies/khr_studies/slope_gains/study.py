"""Select the gains that hold each slope of a sweep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import pandas as pd
import pyarrow as pa

from khr_common.errors import KhrError
from khr_studies.measuring.run_table import run_table, tally
from khr_sweeps.results.folder import request_of

INCLINATION = 'simulator.inclination_deg'
SYMBOLS = {'ankle_controller.gain': 'K_A', 'hip_controller.gain': 'K_H'}
VIBRATION, SLIP = 'vibration_rad_s', 'largest_slip_m'


@dataclass(frozen=True)
class Slope:
    """The gains tried on one slope."""

    condition: dict[str, Any]  # value of the inclination and of each further parameter, by name
    cells: pd.DataFrame  # tally of each gain or pair of gains, in the order of the gains

    @property
    def holding(self) -> pd.DataFrame:
        """Return the gains with which all runs stay up."""
        return self.cells[self.cells['up'] == self.cells['runs']]

    def least(self, column: str) -> pd.Series | None:
        """Return the holding gains with the least value of a column; None if no gain holds."""
        known = self.holding.dropna(subset=[column])
        return None if known.empty else known.loc[known[column].idxmin()]

    @property
    def smallest(self) -> pd.Series | None:
        """Return the smallest holding gains, by K_A first; None if no gain holds."""
        return None if self.holding.empty else self.holding.iloc[0]


def slope_gains(results: pa.Table) -> list[Slope]:
    """Return the slopes of a sweep, each with its gains.

    Args:
        results: from :func:`khr_sweeps.results.folder.read_results`.

    Raises:
        KhrError: if the sweep has no inclination or no gain as lists of values, or no run has an
            outcome.
    """
    axes = request_of(results)['axes']
    gains = [name for name in SYMBOLS if name in axes]
    if INCLINATION not in axes or not gains or not all(isinstance(a, list) for a in axes.values()):
        raise KhrError(
            f'sweep over {", ".join(axes)}: not accepted; accepted: a grid of {INCLINATION} and '
            f'{" or ".join(SYMBOLS)}'
        )
    runs = run_table(results.to_pylist())
    if runs['stayed_up'].notna().sum() == 0:
        raise KhrError('no run of the sweep has an outcome; accepted: a sweep with finished runs')
    others = [name for name in axes if name not in (INCLINATION, *gains)]
    by = [*others, INCLINATION]
    cells = tally(runs, [*by, *gains]).sort_values([*by, *gains], kind='stable')
    return [Slope(dict(zip(by, values, strict=True)), part) for values, part in cells.groupby(by)]
