"""The conditions that are tried: one way from motion, soles and gains to a scenario and back."""

from __future__ import annotations

from dataclasses import dataclass, replace

from khr_balance.ankle import AnkleControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.hip import HipControllerParameters
from khr_bringup.scenario.scenario import Scenario
from khr_sim.run_parameters import RunParameters

INITIAL_TILT_DEG = 0.3  # assumed: error of placing a robot on its board by hand

Changes = tuple[tuple[tuple[str, str], object], ...]  # values by (node, key)


def with_seed(seed: int) -> Changes:
    """Return a seed, and that the robot starts with a small error of its posture."""
    return ((('simulator', 'initial_tilt_deg'), INITIAL_TILT_DEG), (('simulator', 'seed'), seed))


def with_engine(engine: str, changes: Changes = ()) -> Changes:
    """Return changes together with that of the physics engine."""
    return ((('simulator', 'engine'), engine), *changes)


def stiffer_pid(times: float) -> Changes:
    """Return the gains of servos on the identified loop, so many times as stiff."""
    gains = RunParameters()
    return tuple(
        (('simulator', key), times * getattr(gains, key)) for key in ('pid_kp', 'pid_ki', 'pid_kd')
    )


@dataclass(frozen=True)
class Condition:
    """The motion, surface and gains that are tried at every inclination.

    Attributes:
        motion: ``walk``, or ``leg_lift`` on the force-sensor pads.
        surface: of the ground under a walk; a leg lift is always on the pads.
        ankle_gain, hip_gain: K_A and K_H in units of the board; 0 is no control.
        changes: further parameters by (node, key).
        uphill: whether the robot faces uphill, where it falls backward.
    """

    motion: str = 'walk'
    ankle_gain: float = 0.0
    hip_gain: float = 0.0
    surface: str = 'smooth'
    changes: Changes = ()
    uphill: bool = False

    @property
    def title(self) -> str:
        """Name the condition."""
        words = ['stand' if self.motion == 'leg_lift' else self.motion]
        words += ['uphill'] if self.uphill else []
        words += [self.surface] if self.surface == 'rubber' else []
        words += [f'K_A {self.ankle_gain:g}'] if self.ankle_gain else []
        words += [f'K_H {self.hip_gain:g}'] if self.hip_gain else []
        return ', '.join(words if self.ankle_gain or self.hip_gain else [*words, 'no control'])

    def turned(self) -> Condition:
        """Return the condition of a robot that faces the other way."""
        return replace(self, uphill=not self.uphill)

    @staticmethod
    def of(scenario: Scenario) -> tuple[Condition, float]:
        """Return a scenario's condition, without further changes, and its inclination, deg."""
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

        The inclination is rounded to 1e-6 deg. Close to its limit a robot that stays up at 10.2 deg
        falls 2e-15 deg steeper, where the sums of a bisection end.

        Raises:
            StudyError: if a parameter is not accepted.
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
