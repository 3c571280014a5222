"""The file of the robots that explain the data, which comes with the project.

A JSON list, the best robot first, each with its constants by ``node.key`` and its limits in deg by
the title of their condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from khr_bringup.scenario.scenario import CONFIG
from khr_studies.errors import StudyError

SHIPPED_ENSEMBLE = CONFIG / 'ensemble.json'


@dataclass(frozen=True)
class Member:
    """A robot that explains the data.

    Attributes:
        constants: that it does not share with every robot, by ``node.key``.
        limits_deg: its critical inclinations by the condition's title.
    """

    constants: dict[str, float | str]
    limits_deg: dict[str, float]


def read_ensemble(path: Path = SHIPPED_ENSEMBLE) -> list[Member]:
    """Read the members of an ensemble, the best first.

    Raises:
        StudyError: if the file cannot be read or is none.
    """
    try:
        return TypeAdapter(list[Member]).validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise StudyError(
            f'{path}: not an ensemble; accepted: a file that khr calibrate wrote '
            f'({" ".join(str(error).split())[:120]})'
        ) from error


def spread_of(members: list[Member]) -> dict[str, tuple[float, float]]:
    """Return the lowest and the highest limit of the members, deg, by the condition's title."""
    found: dict[str, list[float]] = {}
    for member in members:
        for title, limit in member.limits_deg.items():
            if isfinite(limit):
                found.setdefault(title, []).append(limit)
    return {title: (min(limits), max(limits)) for title, limits in found.items()}
