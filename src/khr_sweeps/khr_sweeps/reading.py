"""Read and validate sweeps from YAML or plain data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.control_text import title_of
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.errors import named
from khr_common.strict_yaml import read_file, read_yaml
from khr_sweeps.axes import (
    CASE,
    SCENARIO,
    Axis,
    check_value,
    grid_axis,
    parameter_named,
    random_axis,
    refuse,
)
from khr_sweeps.specification import Cases, Sweep, by_parameter

FAST = 'fast'
DURATION = 'simulator.duration'
INITIAL_ERROR = 'simulator.initial_tilt_deg'
LARGEST_SWEEP = 1_000_000
VALUES = 'a mapping of node.parameter to a value'
AXES = 'a mapping of node.parameter to values'
COUNT = f'integer in [1, {LARGEST_SWEEP}]'
Count = Annotated[int, Field(ge=1, le=LARGEST_SWEEP)]
Name = Annotated[str, Field(min_length=1)]
Some = Annotated[dict[str, Any], Field(min_length=1)]


class SweepForm(BaseModel):
    """The keys of a sweep; the description of each states the accepted values."""

    model_config = ConfigDict(strict=True, extra='forbid')

    scenario: str | Annotated[list[str], Field(min_length=1)] = Field(
        description='a scenario file or name, or a list of them'
    )
    set: dict[str, Any] = Field({}, description=VALUES)
    duration: Any = Field(None, description='a time in s')
    seeds: Count | None = Field(None, description=COUNT)
    cases: dict[Name, Any] = Field({}, min_length=1, description='a mapping of labels to values')
    grid: Some = Field({}, description=AXES)
    random: Some = Field({}, description=AXES)
    samples: Count | None = Field(None, description=f'{COUNT} with random, nothing without')
    keep: Literal['series'] | None = Field(None, description='series')
    bisect: Name = Field('', description='an axis of numbers')


KEYS = tuple(SweepForm.model_fields)
KNOWN = ', '.join((*KEYS, FAST))


def load_sweep(path: Path, fast: bool = False) -> Sweep:
    """Read a sweep from a file.

    Args:
        path: the file.
        fast: whether the keys under ``fast`` replace those of the same name.

    Raises:
        KhrError: if there is no such file, or it is not valid; the message names file, key,
            value and the accepted values.
    """
    if not path.is_file():
        raise KhrError(f'{path}: no such sweep; accepted: a YAML file with the keys {KNOWN}')
    return parse_sweep(read_file(path), str(path), fast)


def parse_sweep(text: str, file: str, fast: bool = False) -> Sweep:
    """Read a sweep from text; ``file`` is its name in error messages."""
    return sweep_from(read_yaml(text, file), file, title_of(text), fast)


def sweep_from(given: Any, file: str, title: str = '', fast: bool = False) -> Sweep:
    """Read a sweep from plain data, a mapping as in a file.

    Both forms are checked, whichever is returned.

    Args:
        given: the data.
        file: its name in error messages; its stem is the name of the sweep.
        title: of the sweep.
        fast: whether the keys under ``fast`` replace those of the same name.
    """
    if not isinstance(given, Mapping) or 'scenario' not in given:
        raise KhrError(
            f'{file}: not a sweep; accepted: a mapping with scenario, and grid or random'
        )
    usual = {key: value for key, value in given.items() if key != FAST}
    whole = _read(file, Path(file).stem, title, usual)
    if FAST not in given:
        return whole
    replaced = given[FAST]
    if not isinstance(replaced, Mapping) or not set(replaced) <= set(KEYS):
        refuse(f'{file}: {FAST}', replaced, f'a mapping with keys of {", ".join(KEYS)}')
    coarse = _read(f'{file}: {FAST}', whole.name, title, {**usual, **replaced})
    return coarse if fast else whole


def _read(where: str, name: str, title: str, given: dict[Any, Any]) -> Sweep:
    form = _form(where, given)
    found = _scenarios(where, form)
    cases = {
        label: _values(where, f'cases: {named(label)}', values)
        for label, values in form.cases.items()
    }
    axes = _axes(where, form)
    if cases:
        axes = {CASE: Axis(tuple(cases)), **axes}
    if isinstance(form.scenario, list):
        axes = {SCENARIO: Axis(tuple(found)), **axes}
    if not axes:
        raise KhrError(
            f'{where}: nothing varies; accepted: grid, random, cases, or a list of scenarios'
        )
    if bool(form.random) != (form.samples is not None):
        refuse(f'{where}: samples', form.samples, SweepForm.model_fields['samples'].description)
    bisect = _bisect(where, form, axes)
    sweep = Sweep(
        where, name, title, found, cases, axes, form.samples, form.seeds, bool(form.keep), bisect
    )
    _check_once(where, form, cases, axes)
    _check_starts(where, sweep, form.set)
    if sweep.count > LARGEST_SWEEP:
        raise KhrError(f'{where}: {sweep.count} runs; accepted: at most {LARGEST_SWEEP}')
    return sweep


def _form(where: str, given: dict[Any, Any]) -> SweepForm:
    for key in given:
        if key not in KEYS:
            raise KhrError(f'{where}: {named(key)}: no such key; accepted: {KNOWN}')
        if given[key] is None:
            refuse(f'{where}: {key}', None, SweepForm.model_fields[key].description)
    try:
        return SweepForm.model_validate(given)
    except ValidationError as error:
        key = str(error.errors()[0]['loc'][0])
        refuse(f'{where}: {key}', given[key], SweepForm.model_fields[key].description)


def _scenarios(where: str, form: SweepForm) -> dict[str, Scenario]:
    """Return the scenarios by name, with the values that are set for all."""
    names = form.scenario if isinstance(form.scenario, list) else [form.scenario]
    changes = _values(where, 'set', form.set)
    if form.duration is not None:
        changes[DURATION] = check_value(
            f'{where}: duration', parameter_named(where, DURATION), form.duration
        )
    found: dict[str, Scenario] = {}
    for name in names:
        try:
            scenario = scenarios.load_scenario(name).changed(by_parameter(changes))
        except KhrError as error:
            raise KhrError(f'{where}: scenario: {error}') from error
        if scenario.name in found:
            refuse(f'{where}: scenario', name, 'each name once')
        found[scenario.name] = scenario
    return found


def _values(where: str, key: str, given: Any) -> dict[str, Any]:
    if not isinstance(given, dict):
        refuse(f'{where}: {key}', given, VALUES)
    return {
        name: check_value(
            f'{where}: {key}: {named(name)}', parameter_named(f'{where}: {key}', name), value
        )
        for name, value in given.items()
    }


def _axes(where: str, form: SweepForm) -> dict[str, Axis]:
    if form.grid and form.random:
        raise KhrError(f'{where}: grid and random; accepted: one of them')
    kind, read = ('grid', grid_axis) if form.grid else ('random', random_axis)
    return {
        name: read(
            f'{where}: {kind}: {named(name)}', parameter_named(f'{where}: {kind}', name), values
        )
        for name, values in (form.grid or form.random).items()
    }


def _bisect(where: str, form: SweepForm, axes: dict[str, Axis]) -> str:
    numbers = [
        name
        for name in form.grid
        if all(type(value) in (int, float) for value in axes[name].values)
    ]
    if form.bisect and form.bisect not in numbers:
        refuse(
            f'{where}: bisect', form.bisect, f'an axis of numbers: {", ".join(numbers) or "none"}'
        )
    return form.bisect


def _check_once(where: str, form: SweepForm, cases: Cases, axes: dict[str, Axis]) -> None:
    """Refuse a parameter that is given twice."""
    fixed, of_cases = form.set, {name for values in cases.values() for name in values}
    if form.duration is not None and DURATION in {*fixed, *of_cases, *axes}:
        raise KhrError(f'{where}: duration: given beside {DURATION}; accepted: one of them')
    for one, other, words in (
        (fixed, axes, 'set and swept'),
        (of_cases, axes, 'case and swept'),
        (of_cases, fixed, 'case and set'),
    ):
        both = sorted(set(one) & set(other))
        if both:
            raise KhrError(f'{where}: {both[0]}: both {words}; accepted: one of them')


def _check_starts(where: str, sweep: Sweep, fixed: dict[str, Any]) -> None:
    """Refuse contradicting values of a case, and values that contradict the seeds."""
    of_cases = {name for values in sweep.cases.values() for name in values}
    stated_seeds = sorted(
        name for name in {*sweep.axes, *fixed, *of_cases} if name.endswith('.seed')
    )
    if sweep.seeds is not None and stated_seeds:
        raise KhrError(f'{where}: {stated_seeds[0]}: given beside seeds; accepted: one of them')
    node, key = INITIAL_ERROR.split('.')
    try:
        starts = [scenario for _, scenario in sweep.starts()]
    except KhrError as error:
        raise KhrError(f'{where}: cases: {error}') from error
    stated = all(key in scenario.values.get(node, {}) for scenario in starts)
    for scenario in starts if sweep.seeds is not None else ():
        for name, keys in scenario.values.items():
            if name != node and 'seed' in keys:
                raise KhrError(
                    f'{where}: {scenario.name}: {name}.seed: {keys["seed"]} is stated beside '
                    'seeds; accepted: a scenario without it'
                )
    if sweep.seeds is not None and INITIAL_ERROR not in sweep.axes and not stated:
        raise KhrError(
            f'{where}: seeds: {INITIAL_ERROR} is not stated, without which seeds differ by the '
            'noise of the sensors alone; accepted: a value for it under set, such as 0.3, or 0 for '
            'that noise alone, or an axis of it'
        )
