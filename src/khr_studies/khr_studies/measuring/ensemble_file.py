"""The shipped file of the ensemble: the robots that fit the data of the thesis.

A JSON list, the best robot first, each with its constants by ``node.key`` and its limits in deg by
the title of their condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from math import isfinite
from pathlib import Path
from typing import Any

from khr_bringup.scenario.scenario import CONFIG
from khr_studies.measuring.json_file import read_json

SHIPPED_ENSEMBLE = CONFIG / 'ensemble.json'


@dataclass(frozen=True)
class Member:
    """A robot that fits the data."""

    constants: dict[str, Any]  # those that differ between robots, by node.key
    limits_deg: dict[str, float]  # critical inclinations by the title of the condition

    @property
    def changes(self) -> dict[tuple[str, str], Any]:
        """Return the constants by (node, key)."""
        parts = ((name.partition('.'), value) for name, value in self.constants.items())
        return {(node, key): value for (node, _, key), value in parts}


def read_ensemble(path: Path = SHIPPED_ENSEMBLE) -> list[Member]:
    """Read the members of an ensemble, the best first."""
    return read_json(path, list[Member], 'an ensemble')


def ensemble_digest() -> str:
    """Return a digest of the shipped ensemble, kept with results that name members by number."""
    return sha256(SHIPPED_ENSEMBLE.read_bytes()).hexdigest()[:12]


def spread_of(members: list[Member]) -> dict[str, tuple[float, float]]:
    """Return the lowest and highest limit of the members, deg, by the title of the condition."""
    found: dict[str, list[float]] = {}
    for member in members:
        for title, limit in member.limits_deg.items():
            if isfinite(limit):
                found.setdefault(title, []).append(limit)
    return {title: (min(limits), max(limits)) for title, limits in found.items()}
