"""The ensemble: a diverse selection of the candidates that fit the rows.

The spread of the ensemble shows how well the rows determine the constants: a constant that takes
its whole range is left open by the rows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import stats

from khr_studies.calibration.objective import Candidate, worst_misses
from khr_studies.calibration.plan import CalibrationPlan
from khr_studies.calibration.rows import WantedLimit
from khr_studies.measuring.ensemble_file import Member

Array = NDArray[np.float64]
LEAST, MOST = 20, 40  # members of an ensemble
OPEN = 0.5  # share of the searched range above which a constant counts as open
NEAR_END = 0.05  # of the searched range


@dataclass(frozen=True)
class Ensemble:
    """Candidates that fit."""

    fitting: tuple[Candidate, ...]  # the best, and complete candidates within the tolerances
    members: tuple[int, ...]  # indices of the members in these
    # largest miss of a limit of a member other than the best, in tolerances of its row
    tolerances: float
    # candidates, complete: numbers of measured candidates, and of those measured on every row
    candidates: int
    complete: int

    @property
    def robots(self) -> list[Candidate]:
        """Return the members, the best first."""
        return [self.fitting[index] for index in self.members]

    @property
    def best(self) -> Candidate:
        """Return the member that misses the fewest rows; among equals, the one of least cost."""
        return self.robots[0]

    def values(self, name: str) -> Array:
        """Return a constant of all members."""
        return np.array([robot.constants[name] for robot in self.robots])

    def measured(self, title: str) -> Array:
        """Return the mean value of a row of all members; NaN where it was not measured."""
        return np.array([robot.value(title) for robot in self.robots])


def ensemble(plan: CalibrationPlan, robots: Sequence[Candidate]) -> Ensemble:
    """Select the candidates that fit within a tolerance, or the ``LEAST`` best if fewer fit.

    The best misses the fewest rows by more than their tolerance, and among equals has the least
    cost: the cost sums all misses, so by cost alone a robot that nearly misses everything could
    beat one that meets more rows. It is the best of all candidates and always a member, the only
    one that may miss a limit by more than the tolerance. A candidate that does not stay up on level
    ground does not fit. Of candidates that are one robot (:func:`distinct`) the best is kept; if
    more than ``MOST`` are left, a diverse selection.
    """
    complete = [
        robot for robot in robots if robot.complete and not fails_on_level_ground(plan, robot)
    ]
    complete.sort(key=lambda robot: (merit(plan, robot), worst_miss(plan, robot)))
    misses = [worst_miss(plan, robot) for robot in complete]
    tolerances = max([1.0, *sorted(misses)[:LEAST]])
    fitting = [
        robot
        for robot, miss in zip(complete, misses, strict=True)
        if robot is complete[0] or miss <= tolerances
    ]
    kept = diverse(plan, distinct(plan, fitting), MOST)
    members = tuple(index for index, robot in enumerate(fitting) if robot in kept)
    return Ensemble(tuple(fitting), members, tolerances, len(robots), len(complete))


def distinct(plan: CalibrationPlan, robots: Sequence[Candidate]) -> list[Candidate]:
    """Drop each candidate that is an earlier one with other values of few constants.

    Those that differ in a single constant, or only in constants that the added candidates of the
    plan vary, are one robot: in an ensemble they would count once for each value, and the spread
    of the other constants would come out too small.
    """
    varied = set(varied_constants(plan))
    kept: list[Candidate] = []
    for robot in robots:
        differing = (
            {name for name, value in robot.constants.items() if value != other.constants[name]}
            for other in kept
        )
        if all(len(names) > 1 and not names <= varied for names in differing):
            kept.append(robot)
    return kept


def varied_constants(plan: CalibrationPlan) -> list[str]:
    """Return the names of the constants that the added candidates vary, in the plan's order."""
    return [name for name in plan.constants if len({one[name] for one in plan.added}) > 1]


def ensemble_members(plan: CalibrationPlan, found: Ensemble) -> list[Member]:
    """Return the members as the file of an ensemble has them."""
    return [
        Member(
            {f'{node}.{key}': value for (node, key), value in plan.changes(robot.constants)},
            {row.title: round(robot.value(row.title), 3) for row in plan.limits},
        )
        for robot in found.robots
    ]


def missed_rows(plan: CalibrationPlan, robot: Candidate) -> list[str]:
    """Return the titles of the rows that a candidate misses by more than their tolerance."""
    return [title for title, miss in worst_misses(plan, robot).items() if miss > 1.0]


@dataclass(frozen=True)
class RowInConflict:
    """A row that the best robot misses, and the rows that candidates miss which meet it."""

    row: str  # its title
    # meeting, candidates: numbers of candidates that meet it, and of all complete candidates
    meeting: int
    candidates: int
    # rows that the best of the former misses; empty if no candidate meets the row
    missed: tuple[str, ...]


def rows_in_conflict(
    plan: CalibrationPlan, best: Candidate, robots: Sequence[Candidate]
) -> tuple[RowInConflict, ...]:
    """Return the rows that the best candidate misses, with the candidates that meet them."""
    whole = [robot for robot in robots if robot.complete]
    by_merit = sorted(whole, key=lambda each: merit(plan, each))
    ranked = [missed_rows(plan, robot) for robot in by_merit]
    found = []
    for row in missed_rows(plan, best):
        meeting = [missed for missed in ranked if row not in missed]
        found.append(RowInConflict(row, len(meeting), len(ranked), tuple(next(iter(meeting), ()))))
    return tuple(found)


def merit(plan: CalibrationPlan, robot: Candidate) -> tuple[int, float]:
    """Return the number of missed rows and the cost of a candidate: the smallest is the best."""
    return len(missed_rows(plan, robot)), robot.cost


def fails_on_level_ground(plan: CalibrationPlan, robot: Candidate) -> bool:
    """Return whether a candidate did not stay up on level ground with any of the seeds."""
    level = {row.title for row in plan.walks if row.inclination_deg == 0.0}
    return any(worst_misses(plan, robot).get(title, 0.0) > 0.0 for title in level)


def worst_miss(plan: CalibrationPlan, robot: Candidate) -> float:
    """Return the largest miss of a limit on any engine, in tolerances of its row."""
    known = worst_misses(plan, robot)
    return max(known[row.title] for row in plan.limits)


def pareto_set(plan: CalibrationPlan, robots: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return the robots of which none is at least as good in limits and in mechanism.

    The cost of the limits and the cost of all other rows are the two aims; the robot with the best
    limits comes first.
    """
    limits = {row.title for row in plan.limits}

    def aims(robot: Candidate) -> tuple[float, float]:
        known = worst_misses(plan, robot)
        of_limits = sum(miss**2 for title, miss in known.items() if title in limits)
        return of_limits, sum(miss**2 for miss in known.values()) - of_limits

    found: list[Candidate] = []
    least = np.inf
    for robot in sorted((one for one in robots if one.complete), key=aims):
        if (mechanism := aims(robot)[1]) < least:
            found.append(robot)
            least = mechanism
    return tuple(found)


def diverse(plan: CalibrationPlan, robots: Sequence[Candidate], most: int) -> list[Candidate]:
    """Keep the first candidate, and one after another the furthest from all that are kept.

    Distances are in shares of the searched ranges. The order stays.
    """
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


def constant_spreads(plan: CalibrationPlan, found: Ensemble) -> pd.DataFrame:
    """Return the spread of each constant over the ensemble.

    Returns:
        A row for each constant, by its name: the value ``best`` in the best robot, the smallest and
        the largest value ``low`` and ``high``, the ``share`` of the searched range that the middle
        80 % of the ensemble takes, and whether the rows leave the constant ``open``.
    """
    rows = {}
    for name, constant in plan.constants.items():
        values = found.values(name)
        low, high = np.quantile([constant.share(value) for value in values], [0.1, 0.9])
        rows[name] = (values[0], min(values), max(values), high - low, high - low > OPEN)
    return pd.DataFrame.from_dict(rows, 'index', columns=['best', 'low', 'high', 'share', 'open'])


def constants_at_ends(plan: CalibrationPlan, robot: Candidate) -> list[str]:
    """Return the constants of a robot that lie near an end of their searched range."""
    shares = {name: one.share(robot.constants[name]) for name, one in plan.constants.items()}
    return [name for name, share in shares.items() if not NEAR_END < share < 1.0 - NEAR_END]


def correlations(plan: CalibrationPlan, found: Ensemble) -> Array:
    """Return the rank correlations of the constants over the ensemble, (n, n).

    Those of a constant that is the same in every robot are not defined, NaN.
    """
    ranks = [stats.rankdata(found.values(name)) for name in plan.constants]
    with np.errstate(invalid='ignore'):
        return np.atleast_2d(np.corrcoef(ranks))


def gains(plan: CalibrationPlan) -> list[tuple[WantedLimit, WantedLimit]]:
    """Return pairs of walking limits: without control, and with control."""
    walks = [row for row in plan.limits if row.motion == 'walk']
    return [
        (without, controlled)
        for without in walks
        for controlled in walks
        if not without.ka and not without.kh and controlled is not without
    ]


def frontier(
    robots: Sequence[Candidate], without: WantedLimit, controlled: WantedLimit
) -> tuple[Array, Array]:
    """Return the limits without and with control of all candidates that have both, deg, (n,)."""
    titles = without.title, controlled.title
    pairs = np.array([[robot.value(title) for title in titles] for robot in robots])
    known = pairs[~np.isnan(pairs).any(axis=1)]
    return known[:, 0], known[:, 1]
