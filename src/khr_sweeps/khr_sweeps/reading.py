"""Read sweeps strictly from YAML."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from khr_bringup import scenario as scenarios
from khr_bringup.scenario import Scenario
from khr_bringup.strict_yaml import read_file, read_yaml
from khr_common import KhrError
from khr_common.quoting import named
from khr_sweeps.axes import (
    CASE,
    SCENARIO,
    Axis,
    checked,
    grid_axis,
    parameter_named,
    random_axis,
    refuse,
)
from khr_sweeps.errors import SweepError
from khr_sweeps.specification import Cases, Sweep, keyed

KEYS = (
    'scenario',
    'set',
    'duration',
    'seeds',
    'cases',
    'grid',
    'random',
    'samples',
    'keep',
    'bisect',
)
FAST = 'fast'
SERIES = 'series'
INITIAL_ERROR = 'simulator.initial_tilt_deg'
LARGEST_SWEEP = 1_000_000


def load(path: Path, fast: bool = False) -> Sweep:
    """Read a sweep from a file.

    Args:
        path: the file.
        fast: whether the keys under ``fast`` replace those of the same name.

    Raises:
        SweepError: if there is no such file, or it is not valid; the message names file, key
            and value, and what is accepted.
    """
    if not path.is_file():
        raise SweepError(
            f'{path}: no such sweep; accepted: a YAML file with the keys '
            f'{", ".join((*KEYS, FAST))}'
        )
    return parse(read_file(path), str(path), fast)


def parse(text: str, file: str, fast: bool = False) -> Sweep:
    """Read a sweep from text; ``file`` is its name in error messages.

    Both forms are checked, whichever is returned.

    Raises:
        SweepError: as :func:`load`.
    """
    given = read_yaml(text, file)
    if not isinstance(given, dict) or 'scenario' not in given:
        raise SweepError(
            f'{file}: not a sweep; accepted: a mapping with scenario, and grid or random'
        )
    for key in given:
        if key not in (*KEYS, FAST):
            raise SweepError(
                f'{file}: {named(key)}: no such key; accepted: {", ".join((*KEYS, FAST))}'
            )
    replaced = given.pop(FAST, {})
    if not isinstance(replaced, dict) or not set(replaced) <= set(KEYS):
        refuse(f'{file}: {FAST}', replaced, f'a mapping with keys of {", ".join(KEYS)}')
    whole = _read(file, Path(file).stem, text, given)
    coarse = _read(f'{file}: {FAST}', whole.name, text, given | replaced) if replaced else whole
    return coarse if fast else whole


def _read(where: str, name: str, text: str, given: dict[str, Any]) -> Sweep:
    found = _scenarios(where, given)
    cases = _cases(where, given.get('cases', {}), 'cases' in given)
    axes = _axes(where, given)
    if isinstance(given['scenario'], list):
        axes = {SCENARIO: Axis(tuple(found)), **_of_cases(cases), **axes}
    else:
        axes = _of_cases(cases) | axes
    if not axes:
        raise SweepError(
            f'{where}: nothing varies; accepted: grid, random, cases, or a list of scenarios'
        )
    sweep = Sweep(
        where,
        name,
        scenarios.title_of(text),
        found,
        cases,
        axes,
        _samples(where, given),
        _count(where, 'seeds', given['seeds']) if 'seeds' in given else None,
        _keep(where, given),
        _bisect(where, given, axes),
    )
    _check_once(where, given.get('set', {}), cases, axes)
    _check_starts(where, sweep, given.get('set', {}))
    if sweep.count > LARGEST_SWEEP:
        raise SweepError(f'{where}: {sweep.count} runs; accepted: at most {LARGEST_SWEEP}')
    return sweep


def _of_cases(cases: Cases) -> dict[str, Axis]:
    return {CASE: Axis(tuple(cases))} if cases else {}


def _scenarios(where: str, given: dict[str, Any]) -> dict[str, Scenario]:
    """Read the scenario, or several by name, with the values set for all."""
    names = given['scenario']
    names = names if isinstance(names, list) else [names]
    if not names or not all(isinstance(name, str) for name in names):
        refuse(
            f'{where}: scenario', given['scenario'], 'a scenario file or name, or a list of them'
        )
    changes = _values(where, 'set', given.get('set', {}))
    if 'duration' in given:
        changes['simulator.duration'] = checked(
            f'{where}: duration', parameter_named(where, 'simulator.duration'), given['duration']
        )
    found: dict[str, Scenario] = {}
    for name in names:
        try:
            scenario = scenarios.load(name).changed(keyed(changes))
        except KhrError as error:
            raise SweepError(f'{where}: scenario: {error}') from error
        if scenario.name in found:
            refuse(f'{where}: scenario', name, 'each name once')
        found[scenario.name] = scenario
    return found


def _cases(where: str, given: Any, present: bool) -> Cases:
    if present and (
        not isinstance(given, dict)
        or not given
        or not all(isinstance(label, str) and label for label in given)
    ):
        refuse(f'{where}: cases', given, 'a mapping of labels to values')
    return {
        label: _values(where, f'cases: {named(label)}', values) for label, values in given.items()
    }


def _values(where: str, key: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, dict):
        refuse(f'{where}: {key}', given, 'a mapping of node.parameter to a value')
    return {
        name: checked(
            f'{where}: {key}: {named(name)}', parameter_named(f'{where}: {key}', name), value
        )
        for name, value in given.items()
    }


def _axes(where: str, given: dict[str, Any]) -> dict[str, Axis]:
    kinds = [kind for kind in ('grid', 'random') if kind in given]
    if len(kinds) > 1:
        raise SweepError(f'{where}: grid and random; accepted: one of them')
    axes = {}
    for kind in kinds:
        if not isinstance(given[kind], dict) or not given[kind]:
            refuse(f'{where}: {kind}', given[kind], 'a mapping of node.parameter to values')
        read = grid_axis if kind == 'grid' else random_axis
        for name, values in given[kind].items():
            specification = parameter_named(f'{where}: {kind}', name)
            axes[str(name)] = read(f'{where}: {kind}: {named(name)}', specification, values)
    return axes


def _samples(where: str, given: dict[str, Any]) -> int | None:
    if ('random' in given) != ('samples' in given):
        refuse(
            f'{where}: samples',
            given.get('samples'),
            'an integer from 1 on with random, nothing without',
        )
    return _count(where, 'samples', given['samples']) if 'random' in given else None


def _count(where: str, key: str, value: Any) -> int:
    if type(value) is not int or not 1 <= value <= LARGEST_SWEEP:
        refuse(f'{where}: {key}', value, f'integer in [1, {LARGEST_SWEEP}]')
    return value


def _keep(where: str, given: dict[str, Any]) -> bool:
    if 'keep' in given and given['keep'] != SERIES:
        refuse(f'{where}: keep', given['keep'], SERIES)
    return 'keep' in given


def _bisect(where: str, given: dict[str, Any], axes: dict[str, Axis]) -> str:
    if 'bisect' not in given:
        return ''
    numbers = [
        name
        for name, axis in axes.items()
        if 'grid' in given and all(type(value) in (int, float) for value in axis.values)
    ]
    if given['bisect'] not in numbers:
        refuse(
            f'{where}: bisect',
            given['bisect'],
            f'an axis of numbers: {", ".join(numbers) or "none"}',
        )
    return str(given['bisect'])


def _check_once(where: str, fixed: dict[str, Any], cases: Cases, axes: dict[str, Axis]) -> None:
    """Refuse a parameter that is given twice: one value would silently win."""
    of_cases = {name for values in cases.values() for name in values}
    for one, other, words in (
        (fixed, axes, 'set and swept'),
        (of_cases, axes, 'case and swept'),
        (of_cases, fixed, 'case and set'),
    ):
        both = sorted(set(one) & set(other))
        if both:
            raise SweepError(f'{where}: {both[0]}: both {words}; accepted: one of them')


def _check_starts(where: str, sweep: Sweep, fixed: dict[str, Any]) -> None:
    """Refuse values of cases that contradict one another, and values that contradict seeds."""
    of_cases = {name for values in sweep.cases.values() for name in values}
    stated_seeds = sorted(
        name for name in {*sweep.axes, *fixed, *of_cases} if name.endswith('.seed')
    )
    if sweep.seeds is not None and stated_seeds:
        raise SweepError(f'{where}: {stated_seeds[0]}: given beside seeds; accepted: one of them')
    node, key = INITIAL_ERROR.split('.')
    try:
        stated = all(key in scenario.values.get(node, {}) for _, scenario in sweep.starts())
    except KhrError as error:
        raise SweepError(f'{where}: cases: {error}') from error
    if sweep.seeds is not None and INITIAL_ERROR not in sweep.axes and not stated:
        raise SweepError(
            f'{where}: seeds: {INITIAL_ERROR} is not stated; accepted: a value for '
            'it under set, or an axis of it'
        )
