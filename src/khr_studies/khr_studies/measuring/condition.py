"""Conditions of runs: from motion, surface and gains to a scenario, and back."""

from __future__ import annotations

from dataclasses import dataclass, replace

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.robots import constants_of
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_sim.physics import engines
from khr_sim.run_parameters import RunParameters
from khr_sweeps.trial import Row

INITIAL_TILT_DEG = 0.3  # assumed: error of placing a robot on the slope by hand

Changes = tuple[tuple[tuple[str, str], object], ...]  # values by (node, key)
ENGINE = ('simulator', 'engine')


def with_seed(seed: int) -> Changes:
    """Return the changes for a seed: the seed, and a small error of the initial posture."""
    return ((('simulator', 'initial_tilt_deg'), INITIAL_TILT_DEG), (('simulator', 'seed'), seed))


def check_start(scenario: Scenario) -> None:
    """Refuse a scenario that states other values than :func:`with_seed`, which would replace them.

    The defaults are accepted: a recorded run states all values.
    """
    stated, default = scenario.table(RunParameters), RunParameters()
    for (node, key), own in with_seed(0):
        value, accepted = getattr(stated, key), (getattr(default, key), own)
        if value not in accepted:
            values = ' or '.join(f'{each:g}' for each in dict.fromkeys(accepted))
            raise KhrError.refused(
                f'{scenario.name}: {node}.{key}', value, f'{values}: the search sets it'
            )


# Parameters that a search of a limit sets for each of its runs.
SEARCHED = (('simulator', 'inclination_deg'), *dict(with_seed(0)))


def with_engine(engine: str, changes: Changes = (), robot: str = '') -> Changes:
    """Return a physics engine, the constants of a robot (empty: the default one), then changes."""
    return ((ENGINE, engine), *constants_of(robot).items(), *changes)


def stiffer_pid(factor: float) -> Changes:
    """Return the gains of the identified servo loop, multiplied by a factor."""
    gains = RunParameters()
    return tuple(
        (('simulator', key), factor * getattr(gains, key))
        for key in ('pid_kp', 'pid_ki', 'pid_kd')
    )


@dataclass(frozen=True)
class Condition:
    """Motion, surface and gains of a run; inclination and seed come with each run."""

    motion: str = 'walk'  # walk, or leg_lift on the force-sensor pads
    # ankle_gain, hip_gain: K_A and K_H in units of the board; 0 switches the control off
    ankle_gain: float = 0.0
    hip_gain: float = 0.0
    surface: str = 'smooth'  # under a walk; a leg lift is always on the pads
    changes: Changes = ()  # further parameters by (node, key)
    uphill: bool = False  # whether the robot faces uphill and so falls backward

    @property
    def title(self) -> str:
        """Return a name of motion, surface and gains."""
        words = ['stand' if self.motion == 'leg_lift' else self.motion]
        words += ['uphill'] if self.uphill else []
        words += [self.surface] if self.surface != 'smooth' else []
        words += [f'K_A {self.ankle_gain:g}'] if self.ankle_gain else []
        words += [f'K_H {self.hip_gain:g}'] if self.hip_gain else []
        return ', '.join(words if self.ankle_gain or self.hip_gain else [*words, 'no control'])

    @property
    def label(self) -> str:
        """Return the title and all further changes but the engine.

        On one engine equal labels mean equal runs.
        """
        changes = sorted((node, key, value) for (node, key), value in self.changes)
        words = (
            f'{node}.{key} {float(value) if type(value) is int else value}'
            for node, key, value in changes
            if (node, key) != ENGINE
        )
        return ', '.join((self.title, *words))

    @property
    def engine(self) -> str:
        """Return the physics engine."""
        return str(dict(self.changes).get(ENGINE, engines.DEFAULT))

    def columns(self, inclination_deg: float, seed: int) -> Row:
        """Return the condition columns of a run."""
        return {
            'condition': self.label,
            'engine': self.engine,
            'inclination_deg': round(inclination_deg, 6),
            'seed': seed,
        }

    def turned(self) -> Condition:
        """Return the condition with the robot facing the other way."""
        return replace(self, uphill=not self.uphill)

    @staticmethod
    def of(scenario: Scenario) -> tuple[Condition, float]:
        """Return the condition of a scenario, without further changes, and its inclination, deg."""
        run = scenario.table(RunParameters)
        ankle = scenario.table(AnkleControllerParameters)
        hip = scenario.table(HipControllerParameters)
        return Condition(
            scenario.table(GaitParameters).motion,
            float(ankle.gain) if ankle.enabled else 0.0,
            float(hip.gain) if hip.enabled else 0.0,
            'rubber' if run.surface == 'rubber' else 'smooth',
            uphill=run.inclination_deg < 0.0,
        ), abs(float(run.inclination_deg))

    def scenario(self, inclination_deg: float, seed: int | None = None) -> Scenario:
        """Return the scenario at an inclination; without a seed the posture has no error.

        The inclination is rounded to 1e-6 deg: a bisection ends at 10.2 deg plus 2e-15 deg, where
        a robot close to its limit may fall although it stays up at 10.2 deg.
        """
        standing = self.motion == 'leg_lift'
        changes: dict[tuple[str, str], object] = {
            ('simulator', 'inclination_deg'): round(
                float(-inclination_deg if self.uphill else inclination_deg), 6
            ),
            ('simulator', 'surface'): 'pads' if standing else self.surface,
            ('gait', 'motion'): self.motion,
            ('ankle_controller', 'source'): 'force' if standing else 'gyro',
        }
        for node, gain in (
            ('ankle_controller', self.ankle_gain),
            ('hip_controller', self.hip_gain),
        ):
            changes[node, 'enabled'] = gain > 0.0
            changes[node, 'gain'] = float(gain)
        if standing:
            changes['simulator', 'level_start'] = True
        if seed is not None:
            changes |= dict(with_seed(seed))
        return Scenario(self.title, {}).changed(changes | dict(self.changes))
