"""What a sweep is: a scenario, what is varied in it, and how often; read strictly from YAML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from khr_bringup import scenario as scenarios
from khr_bringup.errors import BringupError
from khr_bringup.scenario import Scenario
from khr_bringup.sweeps.axes import Axis, checked, grid_axis, parameter_named, random_axis
from khr_bringup.sweeps.trial import Trial, complete, identity
from khr_common import ParameterError

KEYS = ('scenario', 'set', 'duration', 'seeds', 'grid', 'random', 'samples')
INITIAL_ERROR = 'simulator.initial_tilt_deg'
LARGEST_SWEEP = 1_000_000


@dataclass(frozen=True)
class Specification:
    """A sweep: every combination of the axes, or random draws from them, each with every seed.

    Attributes:
        file: where it was read from, for error texts.
        scenario: what all runs have in common.
        axes: by ``node.parameter``.
        samples: number of random draws; None for a grid.
        seeds: number of seeds; None leaves the scenario's own.
    """

    file: str
    scenario: Scenario
    axes: dict[str, Axis]
    samples: int | None
    seeds: int | None

    @property
    def count(self) -> int:
        """Count the runs; equal random draws count each."""
        grid = prod(len(axis.values) for axis in self.axes.values())
        return (grid if self.samples is None else self.samples) * (self.seeds or 1)

    def points(self) -> Iterator[dict[str, Any]]:
        """Yield the swept values of each point. Draw i is the same in every sweep of the axes."""
        if self.samples is None:
            for values in product(*(axis.values for axis in self.axes.values())):
                yield dict(zip(self.axes, values, strict=True))
        else:
            for number in range(self.samples):
                generator = np.random.default_rng(number)
                yield {name: axis.draw(generator) for name, axis in self.axes.items()}

    def trials(self, version: str) -> Iterator[Trial]:
        """Yield every run once; all points with the first seed come before those with the next.

        Raises:
            BringupError: if values do not go together.
        """
        defaults = complete(self.scenario)
        tables = {name.split('.')[0]: self.scenario.table(name.split('.')[0])
                  for name in self.axes}
        seen: set[str] = set()
        for seed in [None] if self.seeds is None else range(self.seeds):
            for point in self.points():
                changes = _by_node({**point, **_seeds(seed)})
                self._check(tables, changes)
                own = {node: defaults[node] | keys for node, keys in changes.items()}
                key = identity(defaults | own, version)
                if key in seen:
                    continue  # the same draw again
                seen.add(key)
                values = {node: self.scenario.values.get(node, {}) | changes.get(node, {})
                          for node in {**self.scenario.values, **changes}}
                yield Trial(key, point, seed, replace(self.scenario, values=values), version)

    def record(self) -> dict[str, Any]:
        """Return all that decides which runs the sweep has, as it is stored beside them."""
        return {'scenario': complete(self.scenario),
                'axes': {name: axis.record() for name, axis in self.axes.items()},
                'samples': self.samples, 'seeds': self.seeds}

    def _check(self, tables: dict[str, Any], changes: dict[str, dict[str, Any]]) -> None:
        """Refuse values that are accepted one by one, but not together."""
        for node, table in tables.items():
            try:
                replace(table, **{key: tuple(value) if isinstance(value, list) else value
                                  for key, value in changes[node].items()})
            except ParameterError as error:
                raise BringupError(f'{self.file}: {node}: {error}') from error


def load(path: Path) -> Specification:
    """Read a sweep from a file.

    Raises:
        BringupError: if there is no such file, or it does not read; the text names file, key and
            value, and what is accepted.
    """
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise BringupError(f'{path}: no such sweep; accepted: a YAML file with the keys '
                           f'{", ".join(KEYS)}') from error
    return parse(text, str(path))


def parse(text: str, file: str) -> Specification:
    """Read a sweep from text; ``file`` is what error texts call it.

    Raises:
        BringupError: as :func:`load`.
    """
    given = scenarios.read_yaml(text, file)
    if not isinstance(given, dict) or 'scenario' not in given:
        raise BringupError(f'{file}: not a sweep; accepted: a mapping with scenario, and grid or '
                           'random')
    for key in given:
        if key not in KEYS:
            raise BringupError(f'{file}: {key}: no such key; accepted: {", ".join(KEYS)}')
    kind = [key for key in ('grid', 'random') if key in given]
    if len(kind) != 1:
        raise BringupError(f'{file}: {" and ".join(kind) or "neither grid nor random"}; '
                           'accepted: one of grid, random')
    axes = _axes(file, kind[0], given[kind[0]])
    samples = _samples(file, kind[0], given)
    sweep = Specification(file, _scenario(file, given), axes, samples,
                          _count(file, 'seeds', given['seeds']) if 'seeds' in given else None)
    _check_set(file, given.get('set', {}), axes)
    _check_seeds(file, sweep, given.get('set', {}))
    if sweep.count > LARGEST_SWEEP:
        raise BringupError(f'{file}: {sweep.count} runs; accepted: at most {LARGEST_SWEEP}')
    return sweep


def _axes(file: str, kind: str, given: Any) -> dict[str, Axis]:
    if not isinstance(given, dict) or not given:
        raise BringupError(f'{file}: {kind}: {given!r} is not accepted; accepted: a mapping of '
                           'node.parameter to what it takes')
    read = grid_axis if kind == 'grid' else random_axis
    axes = {}
    for name, values in given.items():
        specification = parameter_named(f'{file}: {kind}', name)
        axes[str(name)] = read(f'{file}: {kind}: {name}', specification, values)
    return axes


def _samples(file: str, kind: str, given: dict[str, Any]) -> int | None:
    if (kind == 'random') != ('samples' in given):
        raise BringupError(f'{file}: samples: {given.get("samples")!r} is not accepted; accepted: '
                           'an integer from 1 on with random, nothing with grid')
    return _count(file, 'samples', given['samples']) if kind == 'random' else None


def _scenario(file: str, given: dict[str, Any]) -> Scenario:
    name = given['scenario']
    if not isinstance(name, str):
        raise BringupError(f'{file}: scenario: {name!r} is not accepted; accepted: a scenario '
                           'file or name')
    fixed = given.get('set', {})
    if not isinstance(fixed, dict):
        raise BringupError(f'{file}: set: {fixed!r} is not accepted; accepted: a mapping of '
                           'node.parameter to a value')
    changes = {name: checked(f'{file}: set: {name}', parameter_named(f'{file}: set', name), value)
               for name, value in fixed.items()}
    if 'duration' in given:
        changes['simulator.duration'] = checked(
            f'{file}: duration', parameter_named(file, 'simulator.duration'), given['duration'])
    try:
        return scenarios.load(name).changed(
            {(node, key): value for node, keys in _by_node(changes).items()
             for key, value in keys.items()})
    except BringupError as error:
        raise BringupError(f'{file}: scenario: {error}') from error


def _count(file: str, key: str, value: Any) -> int:
    if type(value) is not int or not 1 <= value <= LARGEST_SWEEP:
        raise BringupError(f'{file}: {key}: {value!r} is not accepted; accepted: integer in '
                           f'[1, {LARGEST_SWEEP}]')
    return value


def _check_set(file: str, fixed: dict[str, Any], axes: dict[str, Axis]) -> None:
    both = sorted(set(fixed) & set(axes))
    if both:
        raise BringupError(f'{file}: {both[0]}: both set and swept; accepted: one of them')


def _check_seeds(file: str, sweep: Specification, fixed: dict[str, Any]) -> None:
    if sweep.seeds is None:
        return
    taken = [name for name in _seeds(0) if name in sweep.axes or name in fixed]
    if taken:
        raise BringupError(f'{file}: {taken[0]}: given beside seeds; accepted: one of them')
    node, key = INITIAL_ERROR.split('.')
    if INITIAL_ERROR not in sweep.axes and key not in sweep.scenario.values.get(node, {}):
        raise BringupError(f'{file}: seeds: {INITIAL_ERROR} is not stated; accepted: a value for '
                           'it under set, or an axis of it')


def _seeds(seed: int | None) -> dict[str, int]:
    return {} if seed is None else {
        f'{node}.{key}': value for (node, key), value in scenarios.noise_seeds(seed).items()}


def _by_node(values: dict[str, Any]) -> dict[str, dict[str, Any]]:
    nodes: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        node, key = name.split('.')
        nodes.setdefault(node, {})[key] = value
    return nodes
