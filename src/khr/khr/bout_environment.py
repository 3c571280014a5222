"""Two robots of a bout as a PettingZoo environment, for controls that fight one another.

It needs PettingZoo, an extra of this package.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from os import PathLike
from typing import Any

import numpy as np
from gymnasium import spaces

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
from khr.arguments import checked
from khr.runs import named, plain
from khr_analysis.referee import BLUE, DRAW, RED, ROBOTS, judge
from khr_bringup.bout.bout import Bout, load_bout
from khr_common import KhrError
from khr_sim.physics.body import Start
from khr_sim.physics.truth import GroundTruth
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters

try:
    from pettingzoo import ParallelEnv
except ImportError as error:
    raise KhrError('bout_env: needs pettingzoo; accepted: after pip install pettingzoo') from error

STARTS = tuple(f'{robot}_start' for robot in ROBOTS)  # options of a reset
SEEDS = LARGEST_SEED // len(ROBOTS)  # each robot has a seed of its own

Observations = dict[str, Observation]
Numbers = dict[str, float]
Flags = dict[str, bool]
Infos = dict[str, dict[str, Any]]


class BoutEnv(ParallelEnv):  # type: ignore[misc]
    """A round of a bout with the ankle and hip corrections of both robots as actions.

    The agents are ``red`` and ``blue``; observation and action of each are those of
    :class:`khr.BalanceEnv`. A step is one control period of 15 ms. The motions go on as planned;
    the controllers of the bout are turned off. With actions of zero an episode is the round of
    that bout without control, bit for bit to its decision (:attr:`trajectory_hash`).

    The referee ends an episode. Reward: 1 for the winner and -1 for the loser at the end,
    otherwise 0. An episode is terminated by a robot that is down or out of the ring, and truncated
    when the time of the round is over. ``info`` of an agent holds the ``time`` in s; that of the
    last step also the ``winner`` (red, blue or draw), the ``reason``, and the ``outcome`` of the
    robot.

    Args:
        bout: of which each episode is a round.

    Example:
        >>> import khr
        >>> fight = khr.bout_env('shove', engine='mujoco')
        >>> observations, infos = fight.reset(seed=1)
        >>> actions = {agent: fight.action_space(agent).sample() for agent in fight.agents}
        >>> observations, rewards, terminations, truncations, infos = fight.step(actions)
        >>> rewards, infos['blue']['time']
        ({'red': 0.0, 'blue': 0.0}, 0.015)
    """

    metadata: dict[str, Any] = {  # noqa: RUF012
        'name': 'khr_bout_v0',
        'render_modes': [],
        'is_parallelizable': True,
    }
    names = tuple(OBSERVED)

    def __init__(self, bout: Bout) -> None:
        nodes = dict.fromkeys(
            node for each in bout.robots.values() for node in controllers_of(each)
        )
        off = [f'{node}.enabled=false' for node in nodes]
        self._base = bout.set_to([*off, 'referee.rounds=1'])
        self.render_mode = None
        self.possible_agents = list(ROBOTS)
        self.agents: list[str] = []
        self._observations = {robot: observation_space() for robot in ROBOTS}
        self._actions = {robot: action_space() for robot in ROBOTS}
        self._random = np.random.default_rng()
        self._plant: Plant | None = None
        self._starts: list[Start] = []

    @property
    def trajectory_hash(self) -> str:
        """Return the SHA-256 over the episode's states so far, in hex."""
        return self._plant.trajectory_hash if self._plant else ''

    def observation_space(self, agent: str) -> spaces.Box:
        """Return the observation space of an agent."""
        return self._observations[agent]

    def action_space(self, agent: str) -> spaces.Box:
        """Return the action space of an agent."""
        return self._actions[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        """Start an episode.

        Args:
            seed: of the series of episodes; ``infos`` has the ``seed`` that is drawn for this one,
                which as ``simulator.seed`` of a bout gives the same placing errors and noise.
            options: of this episode alone: ``red_start`` and ``blue_start``, x and y in m and
                heading in deg. Others are ignored: PettingZoo's own test passes one.

        Raises:
            KhrError: if a start is not accepted.
        """
        if (number := checked_seed(seed)) is not None:
            self._random = np.random.default_rng(number)
        drawn = int(self._random.integers(SEEDS))
        given = _by_name('options', options or {}, STARTS)
        starts = {f'referee.{each}': given[each] for each in STARTS if each in given}
        bout = _changed(self._base, {'simulator.seed': drawn, **starts})
        robots = bout.in_round(0)
        self._rules = bout.rules
        self._robots = {name: Agent(scenario) for name, scenario in robots.items()}
        plant = self._begin(bout, [each.table(RunParameters) for each in robots.values()])
        plant.start([each.loop.reference(0.0) for each in self._robots.values()])
        self.agents = list(ROBOTS)
        infos = self._infos()
        for info in infos.values():
            info['seed'] = drawn
        return self._observe(), infos

    def step(
        self, actions: Mapping[str, Observation]
    ) -> tuple[Observations, Numbers, Flags, Flags, Infos]:
        """Advance one control period.

        Args:
            actions: of both agents, (2,) each, clipped to the action space.

        Raises:
            KhrError: if an action is missing or not two finite numbers, or no episode goes on.
        """
        if self._plant is None or not self.agents:
            raise KhrError('step: no episode; accepted: after reset()')
        if set(_by_name('actions', actions, ROBOTS)) != set(ROBOTS):
            raise KhrError.refused('actions', [*actions], f'one of {RED} and {BLUE}')
        self._plant.answer([each.act(actions[name]) for name, each in self._robots.items()])
        self._plant.advance()
        observations, infos = self._observe(), self._infos()
        places = {name: truth.position.tolist() for name, truth in self._truths.items()}
        decision = judge(self._rules, infos[RED]['time'], self._outcomes, places)
        rewards = dict.fromkeys(ROBOTS, 0.0)
        if decision is None:
            over = cut = False
        else:
            cut = decision.reason == 'time'
            over = not cut
            self.agents = []
            for name, info in infos.items():
                if decision.winner != DRAW:
                    rewards[name] = 1.0 if name == decision.winner else -1.0
                info |= {
                    'winner': decision.winner,
                    'reason': decision.reason,
                    'outcome': self._outcomes[name],
                }
        return (
            observations, rewards, dict.fromkeys(ROBOTS, over), dict.fromkeys(ROBOTS, cut), infos
        )  # fmt: skip

    def close(self) -> None:
        """Release the physics."""
        if self._plant is not None:
            self._plant.close()
        self._plant, self.agents = None, []

    def _begin(self, bout: Bout, parameters: list[RunParameters]) -> Plant:
        """Return the world of an episode, the one before if it differs by its seeds at most."""
        if (
            self._plant is None
            or bout.starts != self._starts
            or not self._plant.reseed(parameters)
        ):
            self.close()
            self._plant, self._starts = Plant(parameters, bout.starts), bout.starts
        return self._plant

    @property
    def _truths(self) -> dict[str, GroundTruth]:
        assert self._plant is not None
        return dict(zip(ROBOTS, self._plant.truths, strict=True))

    def _observe(self) -> Observations:
        """Pass the last sample to the robots; return their observations."""
        truths = self._truths
        self._outcomes = {
            name: robot.loop.observe(truths[name]) for name, robot in self._robots.items()
        }
        return {name: robot.observation(truths[name]) for name, robot in self._robots.items()}

    def _infos(self) -> Infos:
        time = self._truths[RED].stamp_ns / 1e9
        return {robot: {'time': time} for robot in ROBOTS}


@checked
def bout_env(
    bout: str | PathLike[str], *, set: Mapping[str, Any] | None = None, engine: str | None = None
) -> BoutEnv:
    """Return a PettingZoo environment of a bout; see :class:`BoutEnv`.

    Args:
        bout: name of a bout, or its file.
        set: parameters to change, by ``node.parameter`` for both robots, ``red.node.parameter``
            for one, or ``referee.parameter``.
        engine: ``bullet`` or ``mujoco``; the bout's own by default.

    Raises:
        KhrError: if there is no such bout, or a value is not accepted.

    Example:
        >>> import khr
        >>> fight = khr.bout_env('shove', set={'blue.gait.motion': 'guard'}, engine='mujoco')
        >>> observations, infos = fight.reset(seed=1)
        >>> {agent: observation.shape for agent, observation in observations.items()}
        {'red': (28,), 'blue': (28,)}
    """
    return BoutEnv(_changed(load_bout(str(bout)), named(set, engine=engine)))


def _changed(bout: Bout, changes: Mapping[str, Any]) -> Bout:
    return bout.set_to(f'{key}={_text(key, value)}' for key, value in changes.items())


def _text(key: str, value: Any) -> str:
    """Return a value as on a command line."""
    try:
        return json.dumps(plain(value))
    except (TypeError, ValueError):  # no data, or an integer of thousands of digits
        raise KhrError.refused(key, value, 'a number, text, list or array') from None


def _by_name(name: str, values: Any, known: Iterable[str]) -> Mapping[str, Any]:
    """Return values by name; refuse others."""
    if not isinstance(values, Mapping):
        raise KhrError.refused(name, values, f'values by name, of {" | ".join(known)}')
    return values
