"""The folder of a sweep: what was asked for, a journal of finished runs, and their table.

``sweep.json`` says which runs the sweep has. ``rows.jsonl`` grows by a line per finished run: a
command that is killed at any instant leaves at worst a torn last line. ``results.parquet`` is
the journal as a table, written when the sweep is complete or interrupted. ``series/`` holds the
signals of the runs if the sweep keeps them; those of a run are there before its line is.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.json
import pyarrow.parquet

from khr_bringup.run_signals import Series
from khr_experiments.errors import ExperimentError
from khr_experiments.sweeps.axes import column_named
from khr_experiments.sweeps.trial import RESULTS, Row

REQUEST, JOURNAL, TABLE, SERIES = 'sweep.json', 'rows.jsonl', 'results.parquet', 'series'
_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}
_CHANGED = {
    'version': 'another version of the project',
    'scenario': 'another scenario',
    'cases': 'other cases',
    'axes': 'other axes',
    'samples': 'another number of samples',
    'seeds': 'another number of seeds',
    'keep': 'other things to keep',
}
_ACCEPTED = 'a new or empty folder, or that of this same sweep'


class Folder:
    """A sweep's folder, open for one writer.

    Args:
        path: the folder; it is made if it is not there.
        request: what decides the runs of the sweep, from Specification.record and the version.

    Raises:
        ExperimentError: if the folder cannot be written, holds something else or another sweep, or
            another command is writing it.
    """

    def __init__(self, path: Path, request: dict[str, Any]) -> None:
        self.path = path
        self._request = request
        try:
            path.mkdir(parents=True, exist_ok=True)
            _claim(path, request)
            self._journal: BinaryIO = (path / JOURNAL).open('ab+')
        except OSError as error:
            raise ExperimentError(
                f'--out: {str(path)!r}: {error.strerror}; accepted: a folder that can be written'
            ) from error
        try:
            fcntl.flock(self._journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self._journal.close()
            raise ExperimentError(
                f'--out: {str(path)!r} is being written by another sweep; accepted: {_ACCEPTED}'
            ) from error
        self._journal.truncate(_whole(path / JOURNAL))

    def __enter__(self) -> Folder:
        return self

    def __exit__(self, *_: object) -> None:
        self._journal.close()

    def finished(self) -> set[str]:
        """Return the ids of the runs in the journal."""
        with (self.path / JOURNAL).open(encoding='utf-8') as lines:
            return {json.loads(line)['id'] for line in lines}

    def append(self, rows: Iterable[Row]) -> None:
        """Add finished runs; they are on the disk when this returns."""
        for row in rows:
            self._journal.write(json.dumps(row).encode() + b'\n')
        self._journal.flush()
        os.fsync(self._journal.fileno())

    def keep(self, run: str, series: Series) -> None:
        """Keep the signals of a run, before its row is appended."""
        path = series_path(self.path, run)
        path.parent.mkdir(exist_ok=True)
        series.save(path)

    def export(self) -> Path:
        """Write the journal as a Parquet table; return its path."""
        table, path = self.path / TABLE, self.path / f'{TABLE}.part'
        pyarrow.parquet.write_table(_read_journal(self.path, self._request), path)
        path.replace(table)
        return table


def series_path(folder: Path, run: str) -> Path:
    """Return where the signals of a run are, by its id."""
    return folder / SERIES / f'{run}.npz'


def discard_other(path: Path, request: dict[str, Any]) -> bool:
    """Empty a folder if it holds another sweep, or the same of another version; say if it did.

    Raises:
        ExperimentError: if another command is writing it.
    """
    try:
        stored = json.loads((path / REQUEST).read_text(encoding='utf-8'))
    except (OSError, ValueError):
        return False  # no sweep
    if all(stored.get(key) == value for key, value in request.items()):
        return False
    with Folder(path, stored):
        shutil.rmtree(path / SERIES, ignore_errors=True)
        for file in path.iterdir():
            if file.is_file() and file.name != REQUEST:
                file.unlink()
        (path / REQUEST).unlink()  # last: what is cut here is still known for a sweep
    return True


def read_table(path: Path) -> pa.Table:
    """Read the finished runs of a sweep, complete or not, with the request in the metadata.

    Args:
        path: the sweep's folder, or its Parquet file alone.

    Raises:
        ExperimentError: if there is no sweep.
    """
    try:
        if (path / JOURNAL).is_file():
            return _read_journal(path, json.loads((path / REQUEST).read_text(encoding='utf-8')))
        return pyarrow.parquet.read_table(path / TABLE if path.is_dir() else path)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise ExperimentError(
            f'{path}: no results of a sweep; accepted: the folder of a sweep, or its {TABLE}'
        ) from error


def request_of(table: pa.Table) -> dict[str, Any]:
    """Return what was asked of the sweep that a table comes from.

    Raises:
        ExperimentError: if the table is not from a sweep.
    """
    try:
        request: dict[str, Any] = json.loads(table.schema.metadata[b'khr.sweep'])
        return request
    except (KeyError, TypeError, ValueError) as error:
        raise ExperimentError(
            'the table is not from a sweep; accepted: results of khr sweep'
        ) from error


def _claim(path: Path, request: dict[str, Any]) -> None:
    if not any(path.iterdir()):
        part = path / f'{REQUEST}.part'
        part.write_text(json.dumps(request, indent=1), encoding='utf-8')
        part.replace(path / REQUEST)
    try:
        stored = json.loads((path / REQUEST).read_text(encoding='utf-8'))
    except (FileNotFoundError, ValueError) as error:
        raise ExperimentError(
            f'--out: {str(path)!r} holds something else; accepted: {_ACCEPTED}'
        ) from error
    for key, value in request.items():
        if stored.get(key) != value:
            raise ExperimentError(
                f'--out: {str(path)!r} holds a sweep with {_CHANGED[key]}; accepted: {_ACCEPTED}'
            )


def _whole(journal: Path) -> int:
    """Return the length of the journal up to its last whole line, in bytes."""
    return journal.read_bytes().rfind(b'\n') + 1


def _schema(request: dict[str, Any]) -> pa.Schema:
    columns = {'id': pa.string()}
    for name in request['axes']:
        specification = column_named(name)
        columns[name] = (
            pa.list_(_TYPES[specification.element])
            if specification.element
            else _TYPES[specification.kind]
        )
    columns |= {'seed': pa.int64(), **{name: _TYPES[kind] for name, kind in RESULTS.items()}}
    return pa.schema(list(columns.items()), metadata={'khr.sweep': json.dumps(request)})


def _read_journal(path: Path, request: dict[str, Any]) -> pa.Table:
    schema, length = _schema(request), _whole(path / JOURNAL)
    if not length:
        return schema.empty_table()
    with (path / JOURNAL).open('rb') as file:
        table = pyarrow.json.read_json(
            pa.BufferReader(file.read(length)),
            parse_options=pyarrow.json.ParseOptions(
                explicit_schema=schema, unexpected_field_behavior='error'
            ),
        )
    return table.select(schema.names).cast(schema)
