"""The result of a calibration as data, and the sources of the constants that are not searched.

The constants of the best robot are a parameter file; nothing is fitted per scenario.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files

import yaml

from khr_studies.calibration.ensemble import Ensemble, RowInConflict
from khr_studies.calibration.objective import Candidate
from khr_studies.calibration.plan import CalibrationPlan


@dataclass(frozen=True)
class Calibration:
    """The result of ``khr calibrate``."""

    plan: CalibrationPlan  # constants and rows
    # engine, seed, seeds: of the search
    engine: str
    seed: int
    seeds: int
    runs: int  # their number
    found: Ensemble  # the ensemble
    searched: int = 0  # number of candidates of the search
    pareto: tuple[Candidate, ...] = ()  # robots of which none is better in limits and in mechanism
    resisting: tuple[RowInConflict, ...] = ()  # the rows that the best robot misses

    @property
    def best(self) -> Candidate:
        """Return the best robot; the defaults are its constants."""
        return self.found.best


def fixed_constants() -> dict[str, dict[str, str]]:
    """Return ``kind`` and ``source`` of the constants that are not searched, by node.key."""
    text = files(__package__).joinpath('constants.yaml').read_text(encoding='utf-8')
    found: dict[str, dict[str, str]] = yaml.safe_load(text)
    return found


def parameter_file(plan: CalibrationPlan, robot: Candidate) -> str:
    """Return a ROS 2 parameter file with the constants of a robot."""
    nodes: dict[str, dict[str, dict[str, object]]] = {}
    for (node, key), value in plan.changes(robot.constants):
        nodes.setdefault(node, {'ros__parameters': {}})['ros__parameters'][key] = value
    return (
        '# The robot that stands by its loops: constants written by khr calibrate.\n'
        + yaml.safe_dump(nodes, sort_keys=False)
    )
