"""One run of the recovery study: a push on the standing or the walking robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import Scenario
from khr_common.interfaces import RECOVERY_STATE
from khr_sim.physics.engines import LIBRARIES
from khr_studies.measuring.condition import Changes
from khr_studies.measuring.ensemble_file import read_ensemble
from khr_studies.push.study import START, PushCondition, bracket, largest_push
from khr_sweeps.trial import Row

ENGINES = tuple(LIBRARIES)
GAIN = 12.0  # K_A
WATCH = 6.5  # s after the push: the robot has closed its stance
CYCLES = 2  # of a walk that is pushed in its last
TOLERANCE = 0.05  # of the limit of a walk at one phase
ENABLED: Changes = ((('recovery', 'enabled'), True),)


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
