"""The statements of chapter 5 on single walks and on trends over walks (``thesis_walks.yaml``)."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files
from typing import Any

import yaml

from khr_studies.measuring.condition import Condition
from khr_studies.measuring.thesis_values import ThesisTrend, ThesisWalk, line, walking


def _walk(row: dict[str, Any]) -> tuple[Condition, float]:
    """Return the condition and the inclination of a row, deg; remove their keys from it."""
    gains = float(row.pop('K_A', 0.0)), float(row.pop('K_H', 0.0))
    condition = walking(*gains, row.pop('surface', 'smooth'))
    names = [name for name in row if '.' in name]
    changes = tuple(((name.split('.')[0], name.split('.')[1]), row.pop(name)) for name in names)
    return replace(condition, changes=changes), float(row.pop('deg'))


def _statement(row: dict[str, Any]) -> ThesisWalk:
    condition, inclination_deg = _walk(row)
    for name in ('lines', 'gone'):
        row[name] = tuple(
            (float(peak[0]), float(peak[1])) if isinstance(peak, list) else line(peak)
            for peak in row.get(name, ())
        )
    return ThesisWalk(inclination_deg, condition, **row)


_TABLES = yaml.safe_load(files(__package__).joinpath('thesis_walks.yaml').read_text('utf-8'))
WALKS = tuple(_statement(row) for row in _TABLES['walks'])
TRENDS = tuple(
    ThesisTrend(**{**row, 'walks': tuple(_walk(walk) for walk in row['walks'])})
    for row in _TABLES['trends']
)


def published_lines() -> dict[tuple[float, Condition], tuple[tuple[float, float], ...]]:
    """Return the published peaks of each walk at the gait period of the thesis, Hz."""
    found: dict[tuple[float, Condition], tuple[tuple[float, float], ...]] = {}
    for row in WALKS:
        if row.lines and not row.either and not row.condition.changes:
            walk = row.inclination_deg, row.condition
            known = found.get(walk, ())
            found[walk] = known + tuple(each for each in row.lines if each not in known)
    return found
