"""Key frames of a motion in a CSV or YAML file: joint angles, or feet and centre of mass.

A frame has a time and values of some columns; an empty cell is no key of its column. The name of
a column ends in its unit, as in ``l_knee_deg`` or ``com_x_mm``.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, radians
from typing import Any

import yaml

from khr_balance.gaits.kinematics import ROBOT, GaitError
from khr_common.errors import named
from khr_common.interfaces import JOINTS
from khr_common.strict_yaml import read_yaml

COM = ('com_x', 'com_y')
SOLES = tuple(f'{side}_sole_{name}' for side in 'lr' for name in ('x', 'z', 'pitch'))
LENGTHS = {*COM, *(name for name in SOLES if not name.endswith('pitch'))}
FEET = (*COM, *SOLES, 'torso_roll')
LONGEST = 40_000  # characters; a stored scenario of 64 KiB contains the frames
BOUNDS = {  # of the columns by the last part of their names, in SI units
    'time': (0.0, 3600.0),
    'x': (-10.0, 10.0),
    'y': (-0.2, 0.2),
    'z': (0.0, 0.1),
    'pitch': (0.0, 0.6),
    'roll': (-1.0, 1.0),
}
FACTORS = {'s': 1.0, 'm': 1.0, 'mm': 1e-3, 'rad': 1.0, 'deg': radians(1.0)}


def unit_of(column: str) -> str:
    """Return the SI unit of a column."""
    return 's' if column == 'time' else 'm' if column in LENGTHS else 'rad'


@dataclass(frozen=True)
class KeyFrames:
    """Key frames in SI units.

    Attributes:
        times: of the frames from the start of the motion, increasing, s.
        columns: values of each column, one per frame; None where a frame has no value.
    """

    times: tuple[float, ...]
    columns: Mapping[str, tuple[float | None, ...]]

    @property
    def of_joints(self) -> bool:
        """Return whether the frames have joint angles."""
        return not set(self.columns) & set(FEET)

    def keys(self, column: str) -> list[tuple[float, float]]:
        """Return the times and values of a column; an absent column has none."""
        values = self.columns.get(column, ())
        return [(t, v) for t, v in zip(self.times, values, strict=False) if v is not None]

    def to_csv(self) -> str:
        """Return the frames as CSV in full precision."""
        names = ['time', *self.columns]
        lines = [','.join(f'{name}_{unit_of(name)}' for name in names)]
        for row in zip(self.times, *self.columns.values(), strict=True):
            lines.append(','.join('' if value is None else repr(value) for value in row))
        return '\n'.join(lines) + '\n'

    def to_yaml(self) -> str:
        """Return the frames as YAML in full precision."""
        names = [f'{name}_{unit_of(name)}' for name in ('time', *self.columns)]
        rows = zip(self.times, *self.columns.values(), strict=True)
        frames = [
            {name: value for name, value in zip(names, row, strict=True) if value is not None}
            for row in rows
        ]
        text: str = yaml.safe_dump(
            {'frames': frames}, sort_keys=False, default_flow_style=None, width=1000
        )
        return text


def read_key_frames(text: str, file: str, form: str = 'csv') -> KeyFrames:
    """Read and check key frames.

    Args:
        text: CSV with one header line, or YAML with a list ``frames`` of mappings.
        file: name of the file in error messages.
        form: ``csv`` or ``yaml``.

    Raises:
        GaitError: one line with file, frame, column, value and accepted values.
    """
    rows = _yaml_rows(text, file) if form == 'yaml' else _csv_rows(text, file)
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {name: _column(name, file) for name in names}
    if len(set(columns.values())) < len(columns):
        raise GaitError(f'{file}: a column is given twice; accepted: each column in one unit')
    places = [
        {columns[name]: _value(file, n, name, columns[name], cell) for name, cell in row.items()}
        for n, row in enumerate(rows, 1)
    ]
    times = _times(file, places)
    others = [name for name in columns.values() if name != 'time']
    frames = KeyFrames(
        times, {name: tuple(place.get(name) for place in places) for name in others}
    )
    if not others or not (frames.of_joints or set(others) <= set(FEET)):
        raise GaitError(
            f'{file}: columns {", ".join(others) or "without a value"} are not accepted; accepted: '
            f'joints only, or {", ".join(FEET)} only'
        )
    if len(frames.to_csv()) > LONGEST:
        raise GaitError(f'{file}: too large; accepted: {LONGEST} characters of frames')
    return frames


def _csv_rows(text: str, file: str) -> list[dict[str, Any]]:
    lines = (line for line in text.splitlines() if line.strip() and not line.startswith('#'))
    try:
        table = [[cell.strip() for cell in cells] for cells in csv.reader(lines)]
    except csv.Error as error:
        raise GaitError(f'{file}: {error}; accepted: CSV') from error
    header, *frames = table or [[]]
    if len(set(header)) < len(header):
        raise GaitError(f'{file}: a column is given twice; accepted: each column once')
    rows = []
    for number, cells in enumerate(frames, 1):
        if len(cells) != len(header):
            raise GaitError(
                f'{file}: frame {number}: {len(cells)} values are not accepted; accepted: '
                f'{len(header)}, one for each column'
            )
        rows.append({name: cell for name, cell in zip(header, cells, strict=True) if cell})
    return rows


def _yaml_rows(text: str, file: str) -> list[dict[str, Any]]:
    match read_yaml(text, file):
        case {'frames': [*rows], **others} if not others and all(
            isinstance(r, dict) for r in rows
        ):
            return [{str(name): cell for name, cell in row.items()} for row in rows]
    raise GaitError(f'{file}: accepted: one key frames with a list of mappings')


def _column(name: str, file: str) -> str:
    """Return a column's name without its unit."""
    column, _, unit = name.rpartition('_')
    if column not in ('time', *FEET, *JOINTS):
        raise GaitError(
            f'{file}: {named(name)}: no such column; accepted, each with its unit: time, '
            f'{", ".join((*FEET, *JOINTS))}'
        )
    accepted = {'s': ('s',), 'm': ('m', 'mm'), 'rad': ('rad', 'deg')}[unit_of(column)]
    if unit not in accepted:
        raise GaitError(
            f'{file}: {named(name)}: no such unit; accepted: '
            + ' or '.join(f'{column}_{each}' for each in accepted)
        )
    return column


def _value(file: str, number: int, name: str, column: str, cell: Any) -> float:
    """Return a cell in SI units, if the robot accepts it."""
    factor = FACTORS[name.rpartition('_')[2]]
    low, high = _bounds(column)
    try:
        value = inf if isinstance(cell, bool) else float(cell) * factor
    except (TypeError, ValueError, OverflowError):
        value = inf
    if not (isfinite(value) and low <= value <= high):
        raise GaitError.refused(
            f'{file}: frame {number}: {name}', cell, f'[{low / factor:.4g}, {high / factor:.4g}]'
        )
    return value


def _bounds(column: str) -> tuple[float, float]:
    if column in JOINTS:
        low, high = ROBOT.limits()[JOINTS.index(column)].tolist()
        return low, high
    return BOUNDS[column.rpartition('_')[2]]


def _times(file: str, places: Sequence[Mapping[str, float]]) -> tuple[float, ...]:
    if not places:
        raise GaitError(f'{file}: no frame in it; accepted: one or more')
    times: list[float] = []
    for number, place in enumerate(places, 1):
        if 'time' not in place:
            raise GaitError(f'{file}: frame {number}: accepted: a frame with time_s')
        if times and place['time'] <= times[-1]:
            raise GaitError(
                f'{file}: frame {number}: time_s: {place["time"]:g} is not accepted; accepted: '
                f'above {times[-1]:g}, the time of the frame before'
            )
        times.append(place['time'])
    return tuple(times)


def merged(columns: Mapping[str, Iterable[tuple[float, float]]]) -> KeyFrames:
    """Return key frames with a frame at each time of any column."""
    keys = {name: dict(each) for name, each in columns.items()}
    times = sorted({time for each in keys.values() for time in each})
    return KeyFrames(
        tuple(times), {name: tuple(map(each.get, times)) for name, each in keys.items()}
    )
