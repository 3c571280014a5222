"""Gather what is known of a run from its folder or bag."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from khr_analysis.outcome_text import LABELS, WORDS
from khr_bringup.changes import Change, changes
from khr_bringup.code_version import stated_in, version_in
from khr_bringup.recorded import bag_signals
from khr_bringup.recorded.bags import bag_of, read_what_is_left
from khr_bringup.recorded.run_signals import Series, run_with_series
from khr_bringup.scenario.scenario import Scenario, parse
from khr_common import KhrError
from khr_common.interfaces import OUTCOME, PARAMETER_EVENTS, PUSHED, SCENARIO, STATE
from khr_common.text.quoting import quoted
from khr_common.text.strict_yaml import read_file, read_yaml
from khr_report.errors import ReportError
from khr_sim.run_parameters import RunParameters

OUTCOME_FILES = ('outcome.json', 'outcome.yaml')
ACCEPTED = 'accepted: the folder of a khr run, or its bag'


@dataclass
class RunContents:
    """What is known of a run.

    Attributes:
        name: of its folder.
        folder: where it lies.
        scenario: as it ran.
        outcome: by name, as in ``outcome.json``.
        series: its signals.
        changes: of parameters while it ran.
        pushes: number of pushes received over the topic.
        version: of the code; empty if the run did not record it.
        made_with: the arithmetic, and versions of Python and the libraries; empty likewise.
        notes: what is missing and why, a line each.
    """

    name: str
    folder: Path
    scenario: Scenario | None = None
    outcome: dict[str, Any] = field(default_factory=dict)
    series: Series | None = None
    changes: list[Change] = field(default_factory=list)
    pushes: int = 0
    version: str = ''
    made_with: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    @property
    def parameters(self) -> Scenario:
        """Return the scenario, or one of defaults to interpret the signals."""
        return self.scenario or Scenario('', {})

    @property
    def title(self) -> str:
        """Return the title of what was run."""
        return (self.scenario.title if self.scenario else '') or str(
            self.outcome.get('scenario') or self.name
        )


def contents_of(path: Path) -> RunContents:
    """Gather what is known of a run.

    Raises:
        ReportError: if nothing is known.
    """
    if not path.exists():
        raise ReportError(f'{path}: no such run; {ACCEPTED}')
    folder = path if path.is_dir() else path.parent
    found = RunContents(path.resolve().name, folder)
    if path.is_dir():
        _read_scenario(path / 'scenario.yaml', found)
        _read_outcome(path, found)
    if path.is_file() or bag_of(path) != path or any(path.glob('*.mcap')):
        _read_bag(path, found)
    else:
        _repeat(found)
    return found


def _read_scenario(file: Path, found: RunContents) -> None:
    if not file.is_file():
        found.notes.append(f'{file.name} is missing')
        return
    try:
        text = read_file(file)
        found.version, found.made_with = version_in(text), stated_in(text)
        found.scenario = parse(text, file.name, found.name)
    except KhrError as error:
        found.notes.append(f'{error}; was it made by another version of the project?')


def _read_outcome(folder: Path, found: RunContents) -> None:
    file = next((folder / name for name in OUTCOME_FILES if (folder / name).is_file()), None)
    if file is None:
        found.notes.append(f'{OUTCOME_FILES[0]} is missing')
        return
    try:  # JSON is YAML too
        outcome = read_yaml(read_file(file), file.name)
    except KhrError as error:
        found.notes.append(f'{file.name} cannot be read ({error})')
        return
    if not isinstance(outcome, dict):
        found.notes.append(f'{file.name} holds no outcome')
        return
    found.changes = _changes_in(outcome.pop('changes', None))
    for name in set(outcome) & set(LABELS) - set(WORDS):
        if not _is_number(outcome[name]):
            found.notes.append(f'{file.name}: {name}: {quoted(outcome[name])} is no number')
            del outcome[name]
    found.outcome = outcome


def _changes_in(listed: Any) -> list[Change]:
    """Return the changes that an outcome names; those that do not read are left out."""
    found = []
    for each in listed if isinstance(listed, list) else ():
        values = each if isinstance(each, dict) else {}
        node, dot, parameter = str(values.get('parameter', '')).partition('.')
        if dot and _is_number(values.get('time_s')):
            found.append(Change(float(values['time_s']), node, parameter, values.get('value')))
    return found


def _is_number(value: Any) -> bool:
    """Return whether a value is a finite number, or the text of one."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return False
    with suppress(ValueError, OverflowError):
        return isfinite(float(value))
    return False


def _read_bag(path: Path, found: RunContents) -> None:
    topics = (*bag_signals.topics(), PUSHED, OUTCOME, STATE)
    try:
        messages, damage = read_what_is_left(path, topics)
    except KhrError as error:
        found.notes.append(f'no signals: {error}')
        return
    series = bag_signals.series_of(messages)
    found.changes = changes(messages[PARAMETER_EVENTS]) or found.changes
    found.pushes = len(messages[PUSHED])
    if series.time.size:
        found.series = series
    if damage:
        until = f' to {series.time[-1]:.2f} s' if series.time.size else ''
        found.notes.append(f'the bag is damaged; shown is what can be read{until} ({damage})')
    elif not series.time.size:
        found.notes.append('no signals: the bag holds none of the topics of a khr run')
    if found.scenario is None and messages[SCENARIO]:
        found.scenario = bag_signals.scenario_in(messages)
        text = messages[SCENARIO][-1].data
        found.version, found.made_with = version_in(text), stated_in(text)
    if not found.outcome:
        for message in (*messages[STATE], *messages[OUTCOME]):
            found.outcome |= {pair.key: pair.value for pair in message.values}
        if messages[OUTCOME]:
            found.outcome['verdict'] = messages[OUTCOME][-1].message


def _repeat(found: RunContents) -> None:
    """Compute the signals of a run without a bag by repeating it, if the trajectory is the same."""
    recorded = found.outcome.get('trajectory_hash')
    if found.scenario is None or not recorded or found.outcome.get('end') == 'stopped':
        found.notes.append('no bag, so no signals')
        return
    if found.scenario.table(RunParameters).sync != 'lockstep':
        found.notes.append(
            'no bag, so no signals: the run followed the wall clock and cannot be repeated'
        )
        return
    result, series = run_with_series(found.scenario)
    if result.trajectory_hash == recorded:
        found.series = series
        found.notes.append(
            'no bag; the signals are those of the run repeated, whose trajectory hash is the same'
        )
    else:
        found.notes.append(
            'no bag, so no signals: repeated, the run takes another trajectory; '
            'it was changed while it ran, or made by another version'
        )
