"""A stability map as tables: its cells, the critical value of each line, the best gains."""

from __future__ import annotations

from math import nan
from typing import Any

from khr_studies.stability_map.statistics import wilson
from khr_studies.stability_map.study import StabilityMap

Rows = list[dict[str, Any]]


def tables(counted: StabilityMap) -> dict[str, Rows]:
    """Return the rows of each table that a map has, by the end of its file's name."""
    found = {'': _cells(counted), '_critical': _critical(counted), '_best': _best(counted)}
    return {end: rows for end, rows in found.items() if rows}


def _cells(counted: StabilityMap) -> Rows:
    return [
        {
            counted.x.name: cell.x,
            counted.y.name: cell.y,
            'runs': cell.runs,
            'stayed_up': cell.up,
            'slipped': cell.slipped,
            'lost': cell.runs - cell.up,
            'share_up': cell.up / cell.runs if cell.runs else nan,
            'share_up_low_95': low,
            'share_up_high_95': high,
            'median_fell_at_s': nan if cell.fell_at is None else cell.fell_at,
            'median_vibration_rad_s': nan if cell.vibration is None else cell.vibration,
        }
        for line in counted.cells
        for cell in line
        for low, high in [wilson(cell.up, cell.runs)]
    ]


def _critical(counted: StabilityMap) -> Rows:
    return [
        {
            counted.y.name: of_y,
            f'critical {counted.x.name}': critical.value,
            'low_95': critical.low,
            'high_95': critical.high,
        }
        for of_y, critical in zip(counted.y.labels, counted.critical, strict=False)
    ]


def _best(counted: StabilityMap) -> Rows:
    return [
        {
            counted.x.name: cell.x,
            f'best {counted.y.name}': cell.y,
            'runs': cell.runs,
            'stayed_up': cell.up,
            'slipped': cell.slipped,
            'median_vibration_rad_s': cell.vibration,
        }
        for cell in counted.best
    ]
