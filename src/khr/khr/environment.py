"""The robot as a Gymnasium environment: bring your own balance control, or learn one."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from khr.runs import changes_of, load_scenario
from khr_analysis.outcome import MonitorParameters, OutcomeMonitor
from khr_bringup.offline import ControlLoop, duration
from khr_bringup.scenario import Scenario
from khr_common.interfaces import ANKLE_CORRECTION, GYRO, HIP_CORRECTION, JOINT_REFERENCE
from khr_sim.plant import Plant, mix
from khr_sim.run_parameters import RunParameters

LARGEST = 0.5  # rad, of a correction, either way
GYRO_RANGE, FORCE_RANGE = 100.0, 1000.0  # rad/s and N, far above what a 1.5 kg robot meets
CONTROLLERS = ('ankle_controller', 'hip_controller')

Observation = NDArray[np.float32]


class BalanceEnv(gymnasium.Env):  # type: ignore[misc]
    """One episode is one run of a scenario whose ankle and hip corrections are yours.

    A step is one control period of 15 ms. The gait goes on as planned; the controllers of the
    scenario are turned off. With actions of zero an episode is the run of that scenario, bit for
    bit (:attr:`trajectory_hash`).

    Observation, (7,): roll, pitch and yaw rate as the gyro reads them, rad/s, and the normal
    forces as the sensors read them on l_toe, l_heel, r_toe and r_heel, N.

    Action, (2,): what is added to both ankle pitches and to both hip pitches, rad, from -0.5 to
    0.5; it acts one control period later, as the board does.

    Reward: the seconds that the robot has stayed up in this step. An episode is terminated by a
    fall, and truncated at the end of the scenario.
    """

    metadata: dict[str, Any] = {'render_modes': []}  # noqa: RUF012

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario.changed(
            {('simulator', 'duration'): duration(scenario)}
            | {(node, 'enabled'): False for node in CONTROLLERS}
        )
        most = np.array([*[GYRO_RANGE] * 3, *[FORCE_RANGE] * 4], dtype=np.float32)
        self.observation_space = spaces.Box(-most, most)
        self.action_space = spaces.Box(-LARGEST, LARGEST, (2,), np.float32)
        self._plant: Plant | None = None

    @property
    def trajectory_hash(self) -> str:
        """Return the SHA-256 over the episode's states so far, in hex."""
        return self._plant.trajectory_hash if self._plant else ''

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of placing errors and sensor noise; the last one by default.
            options: none.
        """
        super().reset(seed=seed)
        if seed is not None:
            self.scenario = self.scenario.changed({('simulator', 'seed'): int(seed)})
            self.close()
        if self._plant is None:
            self._plant = Plant(self.scenario.table(RunParameters))
        self._loop = ControlLoop(self.scenario)
        self._monitor = OutcomeMonitor(self.scenario.table(MonitorParameters))
        self._due = self._loop.reference(0.0)
        self._truth = self._plant.start(self._due)
        return self._observe()

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one control period; the corrections are clipped to the action space."""
        assert self._plant is not None, 'reset comes before the first step'
        ankle, hip = np.clip(np.asarray(action, dtype=np.float64), -LARGEST, LARGEST).tolist()
        target = mix(
            list(self._loop.signals[JOINT_REFERENCE]),
            [
                dict.fromkeys(ANKLE_CORRECTION.names, ankle),
                dict.fromkeys(HIP_CORRECTION.names, hip),
            ],
        )
        delayed = self._plant.parameters.control_delay > 0
        self._truth = self._plant.advance(self._due if delayed else target)
        self._due = target
        observation, info = self._observe()
        end = self._plant.end
        fell = info['outcome'].verdict == 'fell' or end == 'tilted'
        reward = 0.0 if fell else self._plant.parameters.control_period
        return observation, reward, fell, bool(end) and not fell, info

    def close(self) -> None:
        """Release the physics."""
        if self._plant is not None:
            self._plant.world.close()
            self._plant = None

    def _observe(self) -> tuple[Observation, dict[str, Any]]:
        self._loop.answer(self._truth)
        outcome = self._monitor.update(self._truth.stamp_ns, self._loop.signals)
        seen = np.array([*self._loop.signals[GYRO], *self._loop.forces], dtype=np.float32)
        return seen, {'time': self._truth.stamp_ns / 1e9, 'outcome': outcome}


def env(
    scenario: str | PathLike[str] | Scenario, *, set: Mapping[str, Any] | None = None
) -> BalanceEnv:
    """Return a Gymnasium environment of a scenario; see :class:`BalanceEnv`.

    Args:
        scenario: name of a scenario, its file, or one that has been loaded.
        set: parameters to change, by ``node.parameter``.

    Raises:
        KhrError: if there is no such scenario, or a value is not accepted.
    """
    return BalanceEnv(load_scenario(scenario).changed(changes_of(set)))
