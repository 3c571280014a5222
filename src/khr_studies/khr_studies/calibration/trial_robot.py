"""A candidate robot on one physics engine: the runs and measurements that its rows ask for."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from khr_analysis.outcome import Outcome
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.offline import ControlLoop, duration, run_offline
from khr_common.errors import KhrError, RunError
from khr_common.limit import bracket_limit
from khr_sim.physics.truth import GroundTruth
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import Changes, Condition
from khr_studies.measuring.critical import START, run_condition
from khr_studies.measuring.loop_response import Loop, Margin, open_loop

ENDS = (0.0, 14.0)  # deg, range of limits: 4 deg beyond the thesis's steepest limit
STEP = 0.8  # deg, first step of a bracket
STAGGER = 0.38196601125  # offset between the brackets of two seeds, in tolerances
GROWTH = 1.6  # factor between two steps of a bracket
FINGERPRINT = 3  # the cycle of the gait whose spectrum is taken, as in the thesis
SHOWN_LINES = 36  # of the spectrum of a cycle: up to 15.2 Hz
LIFTED_HEEL = 0.3  # N, force on a heel below which it has lifted


@dataclass(frozen=True, eq=False)
class MeasuredWalk:
    """The measures of a walk."""

    lasted: float  # share of the run until the fall; 1 if the robot stayed up
    vibration: float = np.nan  # root mean square of the pitch rate above 4 Hz, rad/s
    rate: float = np.nan  # standard deviation of the pitch rate in the third cycle, rad/s
    # amplitudes of the pitch rate at multiples of the cycle's frequency in the third cycle, rad/s,
    # (SHOWN_LINES,)
    lines: NDArray[np.float64] = field(default_factory=lambda: np.zeros(SHOWN_LINES))


class TrialRobot:
    """A candidate on one engine; equal runs are computed once.

    Args:
        changes: engine and parameters.
        tolerance: of the bisections, deg.
        starts: limits measured elsewhere, deg, by title of the condition: the brackets start there.

    Attributes:
        runs: their number.
    """

    def __init__(
        self, changes: Changes, tolerance: float, starts: dict[str, float] | None = None
    ) -> None:
        self.runs = 0
        self._changes, self._tolerance = changes, tolerance
        self._near = dict(starts or {})
        self._limits: dict[tuple[Condition, int], float] = {}
        self._walks: dict[tuple[Condition, float, int], MeasuredWalk] = {}
        self._margins: dict[tuple[Loop, float], Margin] = {}

    def margin(self, loop: Loop, ankle_gain: float) -> Margin:
        """Return the edge of stability of a loop; NaN if there is none or the robot falls."""
        key = loop, ankle_gain
        if key not in self._margins:
            self.runs += 1
            self._margins[key] = Margin(np.nan, np.nan)
            with suppress(RunError, KhrError):
                self._margins[key] = open_loop(loop, self._changes, ankle_gain).margin()
        return self._margins[key]

    def limit(self, condition: Condition, seed: int) -> float:
        """Return the critical inclination of a seed, deg.

        The bracket starts at the limit of another seed or engine, or at the last limit that was
        measured, but never at a number of the thesis.
        """
        key = condition, seed
        if key not in self._limits:
            last = next(reversed(self._limits.values()), START)
            near = self._near.get(condition.title, last)
            found = limit_near(
                lambda phi: self._stays_up(condition, phi, seed), near, seed, self._tolerance
            )
            self._limits[key] = self._near[condition.title] = found
        return self._limits[key]

    def walk(self, condition: Condition, inclination_deg: float, seed: int) -> MeasuredWalk:
        """Return the measures of a walk; one that cannot be computed lasts 0."""
        key = condition, inclination_deg, seed
        if key not in self._walks:
            self.runs += 1
            self._walks[key] = MeasuredWalk(0.0)
            with suppress(RunError, KhrError):
                self._walks[key] = _measure_walk(self._on(condition), inclination_deg, seed)
        return self._walks[key]

    def load_when_tipping(self, condition: Condition, inclination_deg: float, seed: int) -> float:
        """Return the share of the load on the less loaded foot when the last heel lifts.

        It is 1/2 if the robot does not fall, or if it tips on both feet.
        """
        self.runs += 1
        forces: list[NDArray[np.float64]] = []

        def watch(truth: GroundTruth, *_: object) -> None:
            forces.append(truth.contact_force[:, 2].copy())

        with suppress(RunError, KhrError):
            if run_condition(self._on(condition), inclination_deg, seed, watch).fell:
                feet = np.array(forces).reshape(-1, 2, 2)  # sample, side, toe and heel
                last = np.nonzero(feet[:, :, 1].max(axis=1) > LIFTED_HEEL)[0][-1]
                loads = feet[last].sum(axis=1)
                return float(loads.min() / max(loads.sum(), LIFTED_HEEL))
        return 0.5

    def _stays_up(self, condition: Condition, inclination_deg: float, seed: int) -> bool:
        self.runs += 1
        with suppress(RunError, KhrError):
            return run_condition(self._on(condition), inclination_deg, seed).stayed_up
        return False

    def _on(self, condition: Condition) -> Condition:
        return replace(condition, changes=(*self._changes, *condition.changes))


def limit_near(
    stays_up: Callable[[float], bool], near: float, seed: int, tolerance: float
) -> float:
    """Bracket and bisect a limit from an inclination, deg.

    Each seed has its own grid of inclinations, so equal limits of two seeds are no artefact.
    """
    start = near + ((seed + 1) * STAGGER % 1.0 - 0.5) * tolerance
    start = min(max(start, ENDS[0]), ENDS[1])
    return bracket_limit(stays_up, start, ENDS, STEP, tolerance, GROWTH).middle


def _measure_walk(condition: Condition, inclination_deg: float, seed: int) -> MeasuredWalk:
    rates: list[float] = []

    def watch(truth: GroundTruth, _: ControlLoop, __: Outcome) -> None:
        rates.append(float(truth.mean_angular_velocity[1]))

    scenario = condition.scenario(inclination_deg, seed)
    outcome = run_offline(scenario, watch).outcome
    if not outcome.stayed_up:
        return MeasuredWalk(min(outcome.lasted(duration(scenario)), 0.999))
    start, end = gait_of(scenario.table(GaitParameters)).cycle(FINGERPRINT)
    period = scenario.table(RunParameters).control_period
    cycle = np.array(rates[round(start / period) : round(end / period)])
    lines = 2.0 * np.abs(np.fft.rfft(cycle - cycle.mean())) / len(cycle)
    return MeasuredWalk(1.0, outcome.vibration, float(cycle.std()), lines[:SHOWN_LINES])
