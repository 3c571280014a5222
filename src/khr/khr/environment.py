"""The robot as a Gymnasium environment, for a balance control of your own or a learned one.

Importing this module registers :data:`ENVIRONMENTS`; Gymnasium imports it by itself for
``gymnasium.make('khr.environment:khr/Walk-v0')``. Several environments step at once through
``gymnasium.make_vec('khr.environment:khr/Walk-v0', 4, vectorization_mode='async')``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from functools import cached_property
from types import NoneType
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from khr.agent import (
    LARGEST_SEED,
    OBSERVED,
    Agent,
    Observation,
    action_space,
    checked_seed,
    controllers_of,
    observation_space,
)
from khr.arguments import ScenarioLike, checked
from khr.runs import changes_of, plain, prepared
from khr_bringup.offline import duration
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.checks import finite, integer
from khr_report.film.scene import Look, PosedScene
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.ensemble_file import read_ensemble

# ID and default scenario; any other one: gymnasium.make(ID, scenario=NAME).
ENVIRONMENTS = {'khr/Balance-v0': 'stand_0deg', 'khr/Walk-v0': 'walk_7.68deg_ka12'}
# Reward per second of each term; the effort is the sum of the squared actions.
WEIGHTS = {'alive': 1.0, 'pitch_rate': -0.02, 'effort': -0.05}
OPTIONS = {  # of a reset, and the parameter that each sets
    'inclination_deg': 'simulator.inclination_deg',
    'surface': 'simulator.surface',
    'push': 'simulator.pushes',
    'seed': 'simulator.seed',
}


class BalanceEnv(gymnasium.Env):  # type: ignore[misc]
    """A run of a scenario with the ankle and hip corrections as actions.

    A step is one control period of 15 ms. The gait goes on as planned; the controllers of the
    scenario are turned off. With actions of zero an episode is the run of that scenario with that
    seed, bit for bit (:attr:`trajectory_hash`).

    Observation, (28,), float32, in the order of :attr:`names`: roll, pitch and yaw rate as the
    gyro reads them, rad/s; the normal forces as the sensors read them, N; the 17 joint angles,
    rad; the two actions that were taken last; sine and cosine of the phase of the gait cycle, of
    a walk, 0 where a whole cycle starts. Each is clipped to its bound. A policy that needs the
    past wraps the environment in ``gymnasium.wrappers.FrameStackObservation``.

    Action, (2,), from -1 to 1: the corrections of both ankle pitches and of both hip pitches, in
    units of 15 deg; they act one control period later, as on the board.

    Reward: per second 1 for having stayed up, less 0.02 times the squared pitch rate in rad/s and
    0.05 times the sum of the squared actions. ``info`` holds each term, as ``reward_alive``,
    ``reward_pitch_rate`` and ``reward_effort``, and the ``time`` in s; that of an episode's last
    step also the outcome: ``verdict``, ``fell``, ``stayed_up``, ``distance``,
    ``slip_distance``, ``vibration`` and so on, and the whole outcome as ``outcome``.

    An episode is terminated when the robot no longer stays up, by a fall or by sliding over a step
    length, and truncated at the end of the motion.

    Args:
        scenario: run in each episode.
        render_mode: ``rgb_array`` draws the robot, with no screen; ``human`` opens the window of
            the physics engine and needs a screen.
        weights: of terms of the reward; the others keep their defaults.

    Raises:
        KhrError: if a value is not accepted.

    Example:
        >>> import gymnasium
        >>> balance = gymnasium.make('khr.environment:khr/Balance-v0', engine='mujoco')
        >>> observation, info = balance.reset(seed=1, options={'inclination_deg': 2.0})
        >>> round(dict(zip(balance.unwrapped.names, observation))['correction_ankle'])
        0
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        'render_modes': ['rgb_array', 'human'],
        'render_fps': 1.0 / RunParameters.control_period,
    }
    names = tuple(OBSERVED)

    def __init__(
        self,
        scenario: Scenario,
        render_mode: str | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata['render_modes']):
            raise KhrError.refused(
                'render_mode', render_mode, ' | '.join(self.metadata['render_modes'])
            )
        if unknown := set(weights or {}) - set(WEIGHTS):
            raise KhrError.refused('weights', sorted(unknown)[0], ' | '.join(WEIGHTS))
        own: dict[str, Any] = {'render_fps': 1.0 / scenario.table(RunParameters).control_period}
        if not os.environ.get('DISPLAY'):  # the checker of Gymnasium opens one of every mode
            own |= {'render_modes': ['rgb_array']}
        self.metadata = {**self.metadata, **own}
        self.render_mode = render_mode
        self.weights = {**WEIGHTS, **(weights or {})}
        for name, weight in self.weights.items():
            finite(f'weights: {name}', weight)
        self._base = scenario.changed(
            {('simulator', 'duration'): duration(scenario)}
            | {(node, 'enabled'): False for node in controllers_of(scenario)}
            | ({('simulator', 'gui'): True} if render_mode == 'human' else {})
        )
        self.scenario = self._base
        self.observation_space, self.action_space = observation_space(), action_space()
        self._plant: Plant | None = None
        self._over = False  # whether the episode has ended
        self._scene: PosedScene | None = None

    @property
    def trajectory_hash(self) -> str:
        """Return the SHA-256 over the episode's states so far, in hex."""
        return self._plant.trajectory_hash if self._plant else ''

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: of placing errors and sensor noise; without one each episode draws its own from
                ``np_random``.
            options: of this episode alone: ``inclination_deg``; ``surface``; ``push``, one text or
                several as in the parameter ``simulator.pushes``; ``robot``, the number of a member
                of the ensemble; ``seed``, as the argument.

        Raises:
            KhrError: if an option is not accepted.
        """
        seed = checked_seed(seed)
        super().reset(seed=seed)
        if not isinstance(options, (Mapping, NoneType)):
            raise KhrError.refused(
                'options', options, f'values by name, of robot | {" | ".join(OPTIONS)}'
            )
        given = dict(options or {})
        drawn = seed if seed is not None else int(self.np_random.integers(LARGEST_SEED))
        given.setdefault('seed', drawn)
        self._begin(self._base.changed(self._changes(given)))
        self._over = False
        self._agent = Agent(self.scenario)
        assert self._plant is not None
        period = self._plant.parameters[0].control_period
        self._worth = [weight * period for weight in self.weights.values()]
        (self._truth,) = self._plant.start([self._agent.loop.reference(0.0)])
        self._agent.loop.observe(self._truth)
        return self._agent.observation(self._truth), self._info()

    def step(self, action: Observation) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Advance one control period.

        Args:
            action: (2,), clipped to the action space.

        Raises:
            KhrError: if it is not two finite numbers, or no episode goes on.
        """
        if self._plant is None or self._over:
            raise KhrError('step: no episode; accepted: after reset()')
        self._plant.answer([self._agent.act(action)])
        (self._truth,) = self._plant.advance()
        outcome = self._agent.loop.observe(self._truth)
        end = self._plant.end
        lost = not outcome.stayed_up or end == 'tilted'
        terms = self._reward(lost)
        info = self._info() | terms
        if lost or end:
            info |= {
                **outcome._asdict(),
                'fell': outcome.fell,
                'stayed_up': outcome.stayed_up,
                'outcome': outcome,
            }
        cut = bool(end) and not lost
        self._over = lost or cut
        return self._agent.observation(self._truth), sum(terms.values()), lost, cut, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture of the robot, (480, 640, 3), in the mode ``rgb_array``.

        Raises:
            KhrError: if no episode was begun.
        """
        if self.render_mode != 'rgb_array':
            return None  # the engine's own window shows each step
        if self._plant is None:
            raise KhrError('render: no episode; accepted: after reset()')
        if self._scene is None:
            self._scene = PosedScene(self._base)
        camera = Look(width=640, height=480).camera(self._truth)
        return np.asarray(self._scene.picture([self._truth], camera)[0])

    def close(self) -> None:
        """Release physics and pictures."""
        for each in (self._plant, self._scene):
            if each is not None:
                each.close()
        self._plant = self._scene = None

    @cached_property
    def _robots(self) -> list[dict[str, float | str]]:
        return [member.constants for member in read_ensemble()]

    def _changes(self, options: Mapping[str, Any]) -> dict[tuple[str, str], Any]:
        """Return the parameter changes of a reset's options, by node and parameter."""
        changes: dict[str, Any] = {}
        for name, value in options.items():
            if name == 'robot':
                integer('robot', value, 0, len(self._robots) - 1)
                changes |= self._robots[int(value)]
            elif name == 'push':
                pushes = plain(value)
                changes[OPTIONS[name]] = pushes if isinstance(pushes, list) else [pushes]
            elif name in OPTIONS:
                changes[OPTIONS[name]] = value
            else:
                raise KhrError.refused('options', name, f'robot | {" | ".join(OPTIONS)}')
        return changes_of(changes)

    def _begin(self, scenario: Scenario) -> None:
        """Take the scenario of an episode; keep the world if it differs by its seed at most."""
        parameters, self.scenario = scenario.table(RunParameters), scenario
        if self._plant is not None and self._plant.reseed([parameters]):
            return
        if self._plant is not None:
            self._plant.close()
        self._plant = Plant([parameters])

    def _reward(self, lost: bool) -> dict[str, float]:
        """Return the reward terms of the last control period, by their names in ``info``."""
        ankle, hip = self._agent.action
        alive, turning, effort = self._worth  # of a control period
        return {
            'reward_alive': 0.0 if lost else alive,
            'reward_pitch_rate': turning * self._agent.loop.pitch_rate**2,
            'reward_effort': effort * (ankle * ankle + hip * hip),
        }

    def _info(self) -> dict[str, Any]:
        return {'time': self._truth.stamp_ns / 1e9}


@checked
def env(
    scenario: ScenarioLike,
    *,
    set: Mapping[str, Any] | None = None,
    engine: str | None = None,
    render_mode: str | None = None,
    weights: Mapping[str, float] | None = None,
) -> BalanceEnv:
    """Return a Gymnasium environment of a scenario; see :class:`BalanceEnv`.

    Args:
        scenario: name of a scenario, its file, or one that has been loaded.
        set: parameters to change, by ``node.parameter``.
        engine: ``bullet`` or ``mujoco``; the scenario's own by default.
        render_mode: ``rgb_array`` or ``human``.
        weights: of the terms of the reward.

    Raises:
        KhrError: if there is no such scenario, or a value is not accepted.

    Example:
        >>> import khr
        >>> environment = khr.env('stand_0deg', set={'simulator.duration': 0.3})
        >>> observation, info = environment.reset(seed=1)
        >>> observation, reward, fell, over, info = environment.step([0.0, 0.0])
        >>> bool(fell), round(info['time'], 3)
        (False, 0.015)
    """
    return BalanceEnv(prepared(scenario, set, engine=engine), render_mode, weights)


for _id, _scenario in ENVIRONMENTS.items():
    gymnasium.register(_id, entry_point='khr.environment:env', kwargs={'scenario': _scenario})
