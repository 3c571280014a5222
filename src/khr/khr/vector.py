"""Several environments at once, one on each core: one here, each other in a process of its own."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from gymnasium.vector import SyncVectorEnv
from gymnasium.vector.utils import iterate
from numpy.typing import NDArray

from khr.arguments import ScenarioLike, checked
from khr.elsewhere import PATIENCE, RECORD, STEADY, Elsewhere, advance, call, columns
from khr.environment import BalanceEnv, clipped
from khr.runs import prepared
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError, RunError
from khr_sweeps.pool import check_workers

STEADY_INFO = [(name, f'_{name}') for name in STEADY]  # a value, and which have one


class BalanceVectorEnv(SyncVectorEnv):  # type: ignore[misc]
    """Environments of a scenario that step at once: the first here, each other in a process.

    It does what ``gymnasium.vector.SyncVectorEnv`` does, bit for bit, episodes that end included:
    they begin again with the next step. Processes end with :meth:`close`, and with this process
    however it ends.

    Raises:
        RunError: if a process cannot be started, or has ended.
    """

    _autoreset_envs: NDArray[np.bool_]  # whose episode has ended

    def __init__(
        self,
        num_envs: int,
        scenario: Scenario,
        render_mode: str | None = None,
        weights: Mapping[str, float] | None = None,
    ) -> None:
        own = BalanceEnv(scenario, render_mode, weights)
        self._all = np.ones(num_envs, np.bool_)
        patience = PATIENCE if num_envs <= len(os.sched_getaffinity(0)) else 0.0
        self._others: list[Elsewhere] = []
        # Workers are killed with the thread that started them, so that is one of their own.
        self._starter = ThreadPoolExecutor(1)
        file = os.memfd_create('environments')
        try:
            os.ftruncate(file, num_envs * RECORD.itemsize)
            self._shared = columns(file)
            for index in range(1, num_envs):
                other = Elsewhere(own, index, file, patience, self._starter)
                self._others.append(other)
                other.send((scenario, render_mode, weights, index, patience))
        except OSError as error:
            self._end()
            raise RunError(f'no environment can be started: {error.strerror}') from error
        finally:
            os.close(file)
        super().__init__([lambda each=each: each for each in (own, *self._others)])

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Start an episode of each.

        Args:
            seed: of the first, the next has the next; or one for each.
            options: of each; see :meth:`BalanceEnv.reset`. ``reset_mask``, (num_envs,), bool, says
                which are reset.
        """
        given = dict(options or {})
        mask = given.pop('reset_mask', [True] * self.num_envs)
        if isinstance(seed, int):
            seed = [seed + index for index in range(self.num_envs)]
        seeds = seed or [None] * self.num_envs
        try:
            for other, own, wanted in zip(self._others, seeds[1:], mask[1:], strict=False):
                if wanted:
                    other.ask('reset', seed=own, options=given)
            self._env_obs = list(self._shared['observation'])  # of those that are not reset
            observations, infos = super().reset(seed=seed, options=options)
            self._shared['observation'][:] = observations
            return observations, infos
        finally:
            self._settle()

    def step(
        self, actions: Iterable[Any]
    ) -> tuple[
        NDArray[np.float32],
        NDArray[np.float64],
        NDArray[np.bool_],
        NDArray[np.bool_],
        dict[str, Any],
    ]:
        """Advance each by one control period.

        Args:
            actions: (num_envs, 2), clipped to the action space. Where an episode has ended, the
                step begins the next one, and takes no action.
        """
        shared = self._shared
        shared['autoreset'][:] = self._autoreset_envs
        self._take(actions)
        try:
            for other in self._others:
                other.begin()
            infos = [advance(self.envs[0], shared, 0)]
            infos += [other.answer() for other in self._others]
        finally:
            self._settle()
        self._autoreset_envs = shared['terminated'] | shared['truncated']
        return (
            shared['observation'].copy(),
            shared['reward'].copy(),
            shared['terminated'].copy(),
            shared['truncated'].copy(),
            self._batched(infos),
        )

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """Return what a method of each returns, or an attribute of each."""
        try:
            for other in self._others:
                other.ask(name, *args, **kwargs)
            first = call(self.envs[0], name, args, kwargs)
            return (first, *(other.answer() for other in self._others))
        finally:
            self._settle()

    def render(self) -> tuple[Any, ...]:
        """Return a picture of each; see :meth:`BalanceEnv.render`."""
        return self.call('render')

    def close_extras(self, **_: Any) -> None:
        """End the processes; release physics and pictures."""
        self.envs[0].close()
        self._end()

    def _take(self, actions: Iterable[Any]) -> None:
        """Write actions where each environment reads its own."""
        taken = self._shared['action']
        try:
            numbers = np.asarray(actions, np.float64)
        except (TypeError, ValueError):
            numbers = np.full(1, np.nan)
        if numbers.shape == taken.shape and np.isfinite(numbers).all():
            taken[:] = np.minimum(np.maximum(numbers, -1.0), 1.0)
            return
        each = list(iterate(self.action_space, actions))
        if len(each) != self.num_envs:
            raise KhrError(
                f'actions: {len(each)} are not accepted; accepted: {self.num_envs}, one for each'
            )
        for index, action in enumerate(each):
            if not self._autoreset_envs[index]:
                taken[index] = clipped(action)

    def _end(self) -> None:
        for other in self._others:
            other.close()
        self._starter.shutdown()

    def _settle(self) -> None:
        """Wait for what nobody has waited for: after an error, nothing is left under way."""
        for other in self._others:
            other.settle()

    def _batched(self, infos: list[dict[str, Any] | None]) -> dict[str, Any]:
        """Return infos of each, None for what its record has, as one of all."""
        found: dict[str, Any] = {}
        if any(infos):
            for index, info in enumerate(infos):
                values = self._shared['info'][index].tolist()
                found = self._add_info(
                    found, info or dict(zip(STEADY, values, strict=True)), index
                )
        else:
            for (name, mask), values in zip(
                STEADY_INFO, self._shared['info'].T.copy(), strict=True
            ):
                found[name], found[mask] = values, self._all.copy()
        return found


@checked
def vector_env(
    scenario: ScenarioLike,
    num_envs: int,
    *,
    set: Mapping[str, Any] | None = None,
    engine: str | None = None,
    render_mode: str | None = None,
    weights: Mapping[str, float] | None = None,
) -> BalanceVectorEnv:
    """Return environments of a scenario that step at once, each on a core.

    ``gymnasium.make_vec('khr/Walk-v0', 2)`` makes the same. It is a Gymnasium vector environment,
    which starts an episode that has ended anew with the next step.

    Args:
        scenario: name of a scenario, its file, or one that has been loaded.
        num_envs: how many; with as many as there are cores each has its own.
        set: parameters to change, by ``node.parameter``.
        engine: ``bullet`` or ``mujoco``; the scenario's own by default.
        render_mode: ``rgb_array`` or ``human``.
        weights: of the terms of the reward.

    Raises:
        KhrError: if there is no such scenario, or a value is not accepted.

    Example:
        >>> import khr
        >>> environments = khr.vector_env('stand_0deg', 2, engine='mujoco')
        >>> observations, infos = environments.reset(seed=1)
        >>> observations, rewards, fell, over, infos = environments.step([[0.0, 0.0]] * 2)
        >>> observations.shape, infos['time'].tolist()
        ((2, 28), [0.015, 0.015])
        >>> environments.close()
    """
    count = check_workers(num_envs, 'num_envs')
    return BalanceVectorEnv(count, prepared(scenario, set, engine=engine), render_mode, weights)
