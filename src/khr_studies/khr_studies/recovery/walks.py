"""Push the walking robot at phases of a cycle, up to beyond the limit of the walk."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from khr_studies.measuring.run_table import measure
from khr_studies.recovery.pushes import CASES, ENGINES, Case, columns_of, limit_of_walk, push_walk
from khr_sweeps.pool import Pool

WALK_GOAL = 1.15  # times the limit of the walk
WALK_TIMES = (0.7, 0.85, 1.0, 1.15, 1.3)  # that limit
PHASES = tuple(n / 16 for n in range(8))  # of the push, in cycles; the other half is the mirror


def pushed_walks(pool: Pool, robots: Sequence[int]) -> list[pd.DataFrame]:
    """Push walks of the default robot at all phases, and of others at its weakest one."""

    def limits_of(keys: Sequence[tuple[Case, str, int, float]]) -> pd.DataFrame:
        return measure(
            pool,
            limit_of_walk,
            [
                (
                    {**columns_of('walk', case, engine, robot), 'phase': phase},
                    (case.condition(engine, robot, motion='walk'), phase),
                )
                for case, engine, robot, phase in keys
            ],
        )

    def steps_of(limits: pd.DataFrame) -> pd.DataFrame:
        plan = []
        by = ['case', 'engine', 'robot']
        for (number, engine, robot), each in limits.groupby(by):
            condition = CASES[number].condition(engine, robot, recovery=True, motion='walk')
            plan += [
                (
                    {
                        **columns_of('walk_step', CASES[number], engine, robot),
                        'phase': phase,
                        'times': times,
                    },
                    (condition, times * float(each['held'].min()), phase),
                )
                for phase in each['phase']
                for times in WALK_TIMES
            ]
        return measure(pool, push_walk, plan)

    keys = [
        (case, engine, 0, phase) for case in CASES[:4] for engine in ENGINES for phase in PHASES
    ]
    own = limits_of(keys)
    flat = own[(own['engine'] == ENGINES[-1]) & own['case'].isin([0, 1])]
    weakest = flat.loc[flat.groupby('case')['held'].idxmin()]
    others = limits_of(
        [
            (CASES[row.case], ENGINES[-1], robot, row.phase)
            for row in weakest.itertuples()
            for robot in robots
        ]
    )
    return [own, others, steps_of(own), steps_of(others)]
