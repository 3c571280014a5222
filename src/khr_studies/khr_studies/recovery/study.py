"""Push the standing robot at every level up to far beyond the limit of its ankles.

A bisection assumes that a robot which survives a push survives each smaller one. A robot that steps
may fall at a weak push, by a step that it did not need: a hole. So each level is tried.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from khr_balance.recovery.parameters import BACKWARD, FORWARD, RecoveryParameters
from khr_models.standing.capture_point import (
    Flywheel,
    flywheel_margin,
    growth_rate,
    largest_force,
    step_margin,
)
from khr_studies.measuring.kept_pool import kept_pool
from khr_studies.measuring.run_table import measure
from khr_studies.push.study import stance
from khr_studies.recovery.false_steps import quiet_run, quiet_scenarios, quiet_walks
from khr_studies.recovery.pushes import (
    CASES,
    ENGINES,
    Case,
    columns_of,
    limit_of_ankles,
    push_once,
)
from khr_studies.recovery.walks import pushed_walks
from khr_sweeps.trial import Row

TIMES = tuple(round(0.5 + 0.1 * n, 1) for n in range(14))  # times the limit of the ankles
ROBOTS = (1, 2, 3, 4, 5, 6)  # members of the ensemble
ANGLES = tuple(range(0, 360, 45))  # deg, of an oblique push: 0 from behind, 90 from the right
LEVELS = tuple(round(0.3 + 0.1 * n, 1) for n in range(14))  # N s, of an oblique push
DECISION = 0.1  # s from the start of a push
UNLOADING = 0.045  # s from the decision until the foot leaves the ground
ROOT = Path('runs/recovery')


def study(
    seeds: int = 5, robots: Sequence[int] = ROBOTS, workers: int | None = None
) -> pd.DataFrame:
    """Measure all pushes and quiet runs; return one table, with a column ``part``.

    A command that was interrupted goes on where it stopped. The seeds are those of each push of
    the default robot; members of the ensemble have one.
    """
    keys = [(case, engine, 0) for case in CASES for engine in ENGINES]
    keys += [(case, ENGINES[-1], robot) for case in CASES[:2] for robot in robots]
    with kept_pool(__name__, 'recovery', workers, ROOT) as kept:
        limits = measure(
            kept,
            limit_of_ankles,
            [(columns_of('ankle', *key), (key[0].condition(*key[1:]),)) for key in keys],
        )
        steps = [
            (
                {**columns_of('step', *key), 'seed': seed, 'times': times},
                (key[0].condition(*key[1:], seed, recovery=True), times * float(limit)),
            )
            for key, limit in zip(keys, limits['held'], strict=True)
            for seed in range(1, 2 if key[2] else 1 + seeds)
            for times in TIMES
        ]
        guards = [
            (
                {**columns_of('guard', case, engine, 0), 'impulse': impulse},
                (case.condition(engine, motion='guard'), impulse),
            )
            for case in CASES[:2]
            for engine in ENGINES
            for impulse in LEVELS
        ]
        oblique = [
            (
                {'part': 'oblique', 'angle': angle, 'recovery': steps_too, 'impulse': impulse},
                (CASES[0].condition(ENGINES[-1], recovery=steps_too), impulse, angle),
            )
            for angle in ANGLES
            for steps_too in (False, True)
            for impulse in LEVELS
        ]
        pushes = measure(kept, push_once, [*steps, *guards, *oblique])
        runs = measure(kept, quiet_run, [*quiet_scenarios(), *quiet_walks()])
        walks = pushed_walks(kept, robots)
    return pd.concat([limits, pushes, runs, *walks], ignore_index=True)


def held(runs: pd.DataFrame, level: str) -> tuple[float, list[float]]:
    """Return the largest level below the first fall, and the holes, the other levels with falls.

    A hole lies below a level that every run survives. ``level`` names the column of the size of
    the push.
    """
    fell = runs.groupby(level)['fell'].any()
    survived = fell[~fell].index
    highest = max(survived, default=0.0)
    holes = [float(each) for each in fell[fell].index if each < highest]
    first = min(fell[fell].index, default=math.inf)
    return float(max((each for each in survived if each < first), default=0.0)), holes


def bounds(case: Case) -> Row:
    """Return the largest impulses of the linear model of the stance, N s, by means of recovery."""
    own = case.condition(ENGINES[0])
    pendulum, inertia = stance(own.base()).tipping(own.direction)
    omega = growth_rate(pendulum, inertia)
    which = FORWARD if own.direction == 'behind' else BACKWARD
    table = RecoveryParameters()
    time = table.swing_time[which] + UNLOADING
    length = table.step_length[which]

    def impulse(margin: float) -> float:
        return case.duration * largest_force(pendulum, inertia, case.duration, margin, DECISION)

    return {
        'planted': impulse(0.0),
        'flywheel': impulse(flywheel_margin(pendulum, inertia, Flywheel())),
        'step': impulse(step_margin(length, time, omega)),
        'steps': impulse(step_margin(length, time, omega, math.inf)),
    }
