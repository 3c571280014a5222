"""The robots that explain the data: every candidate of a search that fits, thinned to be diverse.

One best robot says nothing of how well the rows determine its constants. The spread of all that
fit does: a constant that takes its whole range among them is left open by the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from khr_studies.calibration.objective import FALL, Candidate, row_costs
from khr_studies.calibration.plan import CalibrationPlan, FreeConstant
from khr_studies.calibration.rows import WantedLimit
from khr_studies.measuring.ensemble_file import Member

Array = NDArray[np.float64]
LEAST, MOST = 20, 40  # members of an ensemble
OPEN = 0.5  # share of the range searched from which on a constant counts as open


@dataclass(frozen=True)
class Ensemble:
    """Robots that fit.

    Attributes:
        robots: the best first.
        tolerances: by how many of its tolerances a row of a member misses the thesis at most.
        candidates: how many were measured, of which ``complete`` on every row.
        fitting: how many of them are within those tolerances.
    """

    robots: tuple[Candidate, ...]
    tolerances: float
    candidates: int
    complete: int
    fitting: int

    @property
    def best(self) -> Candidate:
        """Return the robot that misses the fewest rows, among equals at the least cost."""
        return self.robots[0]

    def values(self, name: str) -> Array:
        """Return a constant of all members."""
        return np.array([robot.constants[name] for robot in self.robots])

    def limits(self, title: str) -> Array:
        """Return a limit of all members, deg; NaN where it was not measured."""
        return np.array([robot.limit(title) for robot in self.robots])


def ensemble(
    plan: CalibrationPlan, robots: Sequence[Candidate], least: int = LEAST, most: int = MOST
) -> Ensemble:
    """Choose the robots that fit within a tolerance, or the ``least`` best if fewer do.

    The best misses the fewest rows by more than their tolerance, and among equals has the least
    cost: a cost sums all misses, so many small ones outweigh a row that is met. A robot that does
    not stay up on level ground does not fit at all. If more than ``most`` fit, the best is kept,
    and others one by one, each the furthest from all that were kept.
    """
    complete = [robot for robot in robots if robot.complete and not lost_on_level(plan, robot)]
    misses = sorted(worst_miss(plan, robot) for robot in complete)
    tolerances = max([1.0, *misses[:least]])
    fitting = [robot for robot in complete if worst_miss(plan, robot) <= tolerances + 1e-9]
    fitting.sort(key=lambda robot: (merit(plan, robot), worst_miss(plan, robot)))
    return Ensemble(
        tuple(thinned(plan, fitting, most)), tolerances, len(robots), len(complete), len(fitting)
    )


def members(plan: CalibrationPlan, found: Ensemble) -> list[Member]:
    """Return what the file of an ensemble says of its robots."""
    return [
        Member(
            {
                f'{node}.{key}': value if isinstance(value, str) else float(str(value))
                for (node, key), value in plan.changes(robot.constants)
            },
            {title: round(robot.limit(title), 3) for title in robot.limits},
        )
        for robot in found.robots
    ]


def cannot(plan: CalibrationPlan, robot: Candidate) -> list[str]:
    """Name the rows that a robot misses by more than their tolerance."""
    weights = {row.condition.title: row.weight for row in plan.fitted}
    weights |= {row.title: row.weight for row in plan.differences}
    weights |= {row.title: row.weight for row in plan.walks}
    return [title for title, cost in row_costs(plan, robot).items() if cost / weights[title] > 1.0]


@dataclass(frozen=True)
class Resisting:
    """A row that the best robot misses, and what the candidates that meet it miss instead.

    Attributes:
        row: its title.
        meeting, candidates: how many of how many candidates of the search meet it.
        missed: rows that the best of those misses; empty if none meets it.
    """

    row: str
    meeting: int
    candidates: int
    missed: tuple[str, ...]


def resisting(
    plan: CalibrationPlan, best: Candidate, robots: Sequence[Candidate]
) -> tuple[Resisting, ...]:
    """Search all candidates for what meeting a row takes, for each row that the best misses."""
    whole = [robot for robot in robots if robot.complete]
    ranked = [cannot(plan, robot) for robot in sorted(whole, key=lambda each: merit(plan, each))]
    found = []
    for row in cannot(plan, best):
        meeting = [missed for missed in ranked if row not in missed]
        found.append(Resisting(row, len(meeting), len(ranked), tuple(next(iter(meeting), ()))))
    return tuple(found)


def merit(plan: CalibrationPlan, robot: Candidate) -> tuple[int, float]:
    """Return how many rows a robot misses, and its cost: the least is the best."""
    return len(cannot(plan, robot)), robot.cost


def lost_on_level(plan: CalibrationPlan, robot: Candidate) -> bool:
    """Return whether a robot did not stay up with some seed on level ground."""
    level = [row.title for row in plan.walks if row.inclination_deg == 0.0]
    return any(cost >= FALL for title in level for cost in robot.walks.get(title, ()))


def worst_miss(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return by how many of its tolerances the worst fitted limit misses, on the worse engine."""
    limits = [*robot.engines.values()] or [{title: robot.limit(title) for title in robot.limits}]
    return max(
        abs(known[row.condition.title] - row.thesis_deg) / row.tolerance_deg
        for known in limits
        for row in plan.fitted
    )


def thinned(plan: CalibrationPlan, robots: Sequence[Candidate], most: int) -> list[Candidate]:
    """Keep the first robot and those furthest apart, in the order given."""
    if len(robots) <= most:
        return list(robots)
    shares = np.array(
        [
            [constant.share(robot.constants[name]) for name, constant in plan.constants.items()]
            for robot in robots
        ]
    )
    kept = [0]
    distance = np.linalg.norm(shares - shares[0], axis=1)
    while len(kept) < most:
        kept.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(shares - shares[kept[-1]], axis=1))
    return [robots[index] for index in sorted(kept)]


@dataclass(frozen=True)
class Determined:
    """What the rows say of a constant.

    Attributes:
        name, constant: which.
        best: its value in the best robot.
        low, high: least and largest value in the ensemble.
        share: of the range searched that the middle 80 % of the ensemble takes.
    """

    name: str
    constant: FreeConstant
    best: float
    low: float
    high: float
    share: float

    @property
    def is_open(self) -> bool:
        """Return whether the rows leave the constant open."""
        return self.share > OPEN


def determined(plan: CalibrationPlan, found: Ensemble) -> list[Determined]:
    """Return for each constant what the rows say of it."""
    rows = []
    for name, constant in plan.constants.items():
        values = found.values(name).tolist()
        low, high = np.quantile([constant.share(value) for value in values], [0.1, 0.9])
        rows.append(
            Determined(name, constant, values[0], min(values), max(values), float(high - low))
        )
    return rows


def correlations(plan: CalibrationPlan, found: Ensemble) -> Array:
    """Return the rank correlations of the constants over the ensemble, (n, n)."""
    ranks = [stats.rankdata(found.values(name)) for name in plan.constants]
    with np.errstate(invalid='ignore'):
        matrix = np.atleast_2d(np.corrcoef(ranks))
    return np.asarray(np.nan_to_num(matrix))


def gains(plan: CalibrationPlan) -> list[tuple[WantedLimit, WantedLimit]]:
    """Return pairs of fitted walks: without control, and with one."""
    walks = [row for row in plan.fitted if row.motion == 'walk']
    return [
        (without, controlled)
        for without in walks
        for controlled in walks
        if not without.ka and not without.kh and controlled is not without
    ]


def frontier(
    robots: Sequence[Candidate], without: WantedLimit, controlled: WantedLimit
) -> tuple[Array, Array]:
    """Return the limit without control and with control of every candidate that has both, deg."""
    titles = without.condition.title, controlled.condition.title
    pairs = np.array([[robot.limit(title) for title in titles] for robot in robots])
    known = pairs[~np.isnan(pairs).any(axis=1)]
    return known[:, 0], known[:, 1]
