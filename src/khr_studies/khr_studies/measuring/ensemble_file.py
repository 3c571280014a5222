"""The shipped file of the ensemble: the robots that fit the data of the thesis.

A JSON list, the best robot first, each with its constants by ``node.key`` and its limits in deg by
the title of their condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from khr_bringup.scenario.scenario import CONFIG
from khr_common.errors import KhrError

SHIPPED_ENSEMBLE = CONFIG / 'ensemble.json'


@dataclass(frozen=True)
class Member:
    """A robot that fits the data."""

    constants: dict[str, Any]  # those that differ between robots, by node.key
    limits_deg: dict[str, float]  # critical inclinations by the title of the condition


def read_ensemble(path: Path = SHIPPED_ENSEMBLE) -> list[Member]:
    """Read the members of an ensemble, the best first."""
    try:
        return TypeAdapter(list[Member]).validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise KhrError(
            f'{path}: not an ensemble; accepted: a file that khr calibrate wrote '
            f'({" ".join(str(error).split())[:120]})'
        ) from error


def spread_of(members: list[Member]) -> dict[str, tuple[float, float]]:
    """Return the lowest and highest limit of the members, deg, by the title of the condition."""
    found: dict[str, list[float]] = {}
    for member in members:
        for title, limit in member.limits_deg.items():
            if isfinite(limit):
                found.setdefault(title, []).append(limit)
    return {title: (min(limits), max(limits)) for title, limits in found.items()}
