"""Push the standing robot at every level up to far beyond the limit of its ankles.

A bisection assumes that a robot which survives a push survives each smaller one. A robot that steps
may fall at a weak push, by a step that it did not need: a hole. So each level is tried.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.recovery.parameters import BACKWARD, FORWARD, RecoveryParameters
from khr_bringup.bout.bout import SHIPPED, load_bout
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import CONFIG, Scenario, load_scenario
from khr_common.checks import integer
from khr_common.interfaces import RECOVERY_STATE
from khr_models.standing.capture_point import (
    Flywheel,
    flywheel_margin,
    growth_rate,
    largest_force,
    step_margin,
)
from khr_sim.physics.engines import LIBRARIES
from khr_studies.measuring.condition import Changes
from khr_studies.measuring.ensemble_file import ensemble_digest, read_ensemble
from khr_studies.measuring.kept_pool import kept_pool
from khr_studies.measuring.run_table import measure
from khr_studies.push.study import START, PushCondition, bracket, largest_push, stance
from khr_sweeps.pool import Pool
from khr_sweeps.trial import Row

ENGINES = tuple(LIBRARIES)
GAIN = 12.0  # K_A
WATCH = 6.5  # s after the push: the robot has closed its stance
CYCLES = 2  # of a walk that is pushed in its last
TOLERANCE = 0.05  # of the limit of a walk at one phase
ENABLED: Changes = ((('recovery', 'enabled'), True),)
STANDING = ('lift_', 'stand_', 'walk_')  # scenarios without a push
MOTION_TIME = 20.0  # s, of a motion of a bout
BOARD_DEG, BOARD_TIME = 5.0, 1000.0  # a board that tilts at 2 deg/s, and s on it
BOARD: Changes = (
    (('simulator', 'level_start'), True),
    (('simulator', 'inclination_deg'), BOARD_DEG),
    (('simulator', 'duration'), BOARD_TIME),
)
INCLINATIONS = tuple(range(-4, 11))  # deg, of walks
GAINS = ((0.0, 0.0), (12.0, 0.0), (18.0, 0.0), (12.0, 13.0))  # K_A, K_H
WALK_GOAL = 1.15  # times the limit of the walk
WALK_TIMES = (0.25, 0.4, 0.55, 0.7, 0.85, 1.0, 1.15, 1.3)  # that limit
PHASES = tuple(n / 32 for n in range(16))  # of the push, in cycles; the other half is the mirror
TIMES = tuple(round(0.5 + 0.1 * n, 1) for n in range(14))  # times the limit of the ankles
ROBOTS = (1, 2, 3, 4, 5, 6)  # members of the ensemble
ANGLES = tuple(range(0, 360, 45))  # deg, of an oblique push: 0 from behind, 90 from the right
LEVELS = tuple(round(0.3 + 0.1 * n, 1) for n in range(14))  # N s, of an oblique push
DECISION = 0.1  # s from the start of a push
UNLOADING = 0.045  # s from the decision until the foot leaves the ground
ROOT = Path('runs/recovery')


@dataclass(frozen=True)
class Case:
    """A push on the standing robot."""

    direction: str  # behind or front
    inclination: float = 0.0  # of the ground, deg, downhill
    duration: float = 0.1  # of the push, s
    goal: float = 1.0  # the multiple of the limit of the ankles that a step shall hold

    def condition(
        self,
        engine: str,
        robot: int = 0,
        seed: int = 1,
        recovery: bool = False,
        motion: str = 'stand',
    ) -> PushCondition:
        """Return the condition on an engine; robot 0 is the default, others are of the ensemble."""
        changes: dict[tuple[str, str], Any] = {
            ('simulator', 'engine'): engine,
            ('simulator', 'inclination_deg'): self.inclination,
            ('simulator', 'stop_when_tilted_deg'): 88.0,
            ('simulator', 'seed'): seed,
            ('gyro', 'seed'): seed,
            ('foot_force', 'seed'): seed,
            ('gait', 'motion'): motion,
        }
        if motion == 'walk':
            changes['gait', 'cycles'] = CYCLES
        if recovery:
            changes |= dict(ENABLED)
        if robot:
            changes |= read_ensemble()[robot].changes
        own: Changes = tuple(changes.items())
        return PushCondition(GAIN, self.duration, self.direction, changes=own)  # type: ignore[arg-type]


CASES = (
    Case('behind', goal=1.4),
    Case('front', goal=1.3),
    Case('behind', 5.0, goal=1.4),
    Case('front', 5.0),
    Case('behind', duration=0.5, goal=1.2),
    Case('front', duration=0.5, goal=1.2),
)


def watched(scenario: Scenario) -> Row:
    """Run a scenario; return whether and when the robot fell, its slip and its steps."""
    steps, before = 0, 0.0

    def count(_: object, loop: Any, __: object) -> None:
        nonlocal steps, before
        phase = loop.signals[RECOVERY_STATE][0] if RECOVERY_STATE in loop.signals else 0.0
        steps += phase == 1.0 != before
        before = phase

    outcome = run_offline(scenario, count).outcome
    return {
        'fell': outcome.fell,
        'fell_at_s': outcome.fell_at,
        'largest_slip_m': outcome.largest_slip,
        'steps': int(steps),
    }


def push_once(condition: PushCondition, impulse: float, angle: float = 0.0) -> Row:
    """Push the robot once with an impulse, N s, turned to the left by an angle, deg."""
    return watched(condition.scenario(impulse / condition.duration, START, angle, WATCH))


def push_walk(condition: PushCondition, impulse: float, phase: float) -> Row:
    """Push the walking robot once, at a phase of its last cycle, 0 to 1; return the outcome."""
    begin, end = gait_of(condition.base().table(GaitParameters)).cycle(CYCLES)
    start, force = begin + phase * (end - begin), impulse / condition.duration
    return watched(condition.scenario(force, start, watch=WATCH))


def limit_of_walk(condition: PushCondition, phase: float) -> Row:
    """Return as ``held`` the largest impulse, N s, that the walk survives at a phase, 0 to 1."""

    def falls(force: float) -> bool:
        return bool(push_walk(condition, force * condition.duration, phase)['fell'])

    return {'held': bracket(falls, 5.0, TOLERANCE).survived * condition.duration}


def limit_of_ankles(condition: PushCondition) -> Row:
    """Return as ``held`` the largest impulse, N s, that the robot survives by its ankles alone."""
    return {'held': largest_push(condition).survived * condition.duration}


def columns_of(part: str, case: Case, engine: str, robot: int) -> Row:
    """Return the columns that name a run."""
    return {'part': part, 'case': CASES.index(case), 'engine': engine, 'robot': robot}


def quiet_run(scenario: Scenario) -> Row:
    """Run a scenario without a push, with the node; if it steps, without the node as well."""
    found = watched(scenario.changed(dict(ENABLED)))
    without = run_offline(scenario).outcome.fell if found['steps'] else found['fell']
    return {**found, 'fell_without': without, 'name': scenario.name}


def quiet_scenarios() -> list[tuple[Row, tuple[Scenario]]]:
    """Return the scenarios without a push, and a long stance on a board that tilts, then rests."""
    names = sorted(path.stem for path in (CONFIG / 'scenarios').glob('*.yaml'))
    own = [load_scenario(name) for name in names if name.startswith(STANDING)]
    own.append(load_scenario('stand_0deg').changed(dict(BOARD)))
    return [({'part': 'quiet'}, (each,)) for each in own]


def quiet_motions() -> list[tuple[Row, tuple[Scenario]]]:
    """Return the motions of the bouts, each performed by one robot alone."""
    found: dict[tuple[str, str], tuple[Row, tuple[Scenario]]] = {}
    for engine, path in itertools.product(ENGINES, sorted(SHIPPED.glob('*.yaml'))):
        for each in load_bout(str(path)).robots.values():
            motion = Path(each.table(GaitParameters).motion_file).stem
            changes = {('simulator', 'engine'): engine, ('simulator', 'duration'): MOTION_TIME}
            if motion and (engine, motion) not in found:
                columns = {'part': 'motions', 'engine': engine}
                found[engine, motion] = columns, (each.changed(changes),)
    return list(found.values())


def quiet_walks() -> list[tuple[Row, tuple[Scenario]]]:
    """Return walks without a push, of all inclinations and gains."""
    walk, found = load_scenario('walk_0deg'), []
    for engine, inclination, (ka, kh) in itertools.product(ENGINES, INCLINATIONS, GAINS):
        changes = {
            ('simulator', 'engine'): engine,
            ('simulator', 'inclination_deg'): float(inclination),
            ('ankle_controller', 'enabled'): ka > 0.0,
            ('ankle_controller', 'gain'): ka or GAIN,
            ('hip_controller', 'enabled'): kh > 0.0,
            ('hip_controller', 'gain'): kh or GAIN,
        }
        columns = {'inclination_deg': float(inclination), 'ka': ka, 'kh': kh}
        found.append(({'part': 'walks', 'engine': engine, **columns}, (walk.changed(changes),)))
    return found


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


def study(
    seeds: int = 5, robots: Sequence[int] = ROBOTS, workers: int | None = None
) -> pd.DataFrame:
    """Measure all pushes and quiet runs; return one table, with a column ``part``.

    A command that was interrupted goes on where it stopped. The seeds are those of each push of
    the default robot; members of the ensemble have one.
    """
    integer('--seeds', seeds, 1, 100)
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
        quiet = [*quiet_scenarios(), *quiet_motions(), *quiet_walks()]
        runs = measure(kept, quiet_run, quiet)
        walks = pushed_walks(kept, robots)
    found = pd.concat([limits, pushes, runs, *walks], ignore_index=True)
    found.loc[found['robot'] > 0, 'ensemble'] = ensemble_digest()
    return found


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
