"""The file of the robots that explain the data, which comes with the project.

A JSON list, the best robot first, each with its constants by ``node.key`` and its limits in deg by
the title of their condition.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from pydantic import TypeAdapter, ValidationError

from khr_bringup.scenario import CONFIG
from khr_common.files import write_text
from khr_experiments.calibration_plan import CalibrationPlan
from khr_experiments.ensemble import Ensemble
from khr_experiments.errors import ExperimentError

SHIPPED_ENSEMBLE = CONFIG / 'ensemble.json'


@dataclass(frozen=True)
class Member:
    """A robot that explains the data.

    Attributes:
        constants: that it does not share with every robot, by ``node.key``.
        limits_deg: its critical inclinations by the condition's title.
    """

    constants: dict[str, float]
    limits_deg: dict[str, float]


MEMBERS = TypeAdapter(list[Member])


def write_ensemble(path: Path, plan: CalibrationPlan, found: Ensemble) -> None:
    """Write the members of an ensemble.

    Raises:
        KhrError, RunError: if the file cannot be written.
    """
    members = [
        Member(
            {
                f'{node}.{key}': float(str(value))
                for (node, key), value in plan.changes(robot.constants)
            },
            {title: round(robot.limit(title), 3) for title in robot.limits},
        )
        for robot in found.robots
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, MEMBERS.dump_json(members, indent=1).decode() + '\n')


def read_ensemble(path: Path = SHIPPED_ENSEMBLE) -> list[Member]:
    """Read the members of an ensemble, the best first.

    Raises:
        ExperimentError: if the file cannot be read or is none.
    """
    try:
        return MEMBERS.validate_json(path.read_bytes())
    except (OSError, ValidationError) as error:
        raise ExperimentError(
            f'{path}: not an ensemble; accepted: a file that khr calibrate wrote '
            f'({" ".join(str(error).split())[:120]})'
        ) from error


def spread_of(members: list[Member]) -> dict[str, tuple[float, float]]:
    """Return the lowest and the highest limit of the members, deg, by the condition's title."""
    titles = {title for member in members for title in member.limits_deg}
    found = {
        title: [
            member.limits_deg[title]
            for member in members
            if isfinite(member.limits_deg.get(title, float('nan')))
        ]
        for title in titles
    }
    return {title: (min(values), max(values)) for title, values in found.items() if values}
