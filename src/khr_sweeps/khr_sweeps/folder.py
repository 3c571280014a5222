"""The folder of a sweep: its request, a journal of finished runs, and their results.

``sweep.json`` defines the runs of the sweep. ``rows.jsonl`` grows by a line per finished run: a
command that is killed leaves at worst a torn last line. ``results.parquet`` has the same rows,
written when the sweep is complete or interrupted. ``series/`` has the signals of the runs if the
sweep keeps them; they are written before the line of their run.
"""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.json
import pyarrow.parquet

from khr_bringup.run_signals import Series
from khr_sweeps.axes import column_named
from khr_sweeps.errors import SweepError
from khr_sweeps.trial import RESULTS, Row

REQUEST, JOURNAL, PARQUET, SERIES = 'sweep.json', 'rows.jsonl', 'results.parquet', 'series'
_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}
_CHANGED = {
    'version': 'another version of the project',
    'scenario': 'another scenario',
    'cases': 'other cases',
    'axes': 'other axes',
    'samples': 'another number of samples',
    'seeds': 'another number of seeds',
    'keep': 'another choice of what to keep',
    'bisect': 'another bisection',
}
_ACCEPTED = 'a new or empty folder, or that of the same sweep'


class Folder:
    """A sweep's folder, open for one writer.

    Args:
        path: the folder; made if needed.
        request: all that determines the runs of the sweep: what :meth:`Sweep.record
            <khr_sweeps.specification.Sweep.record>` returns, and the version of the code.
        wait: whether to wait for another command that is writing it; it says so.

    Raises:
        SweepError: if the folder cannot be written, contains something else or another
            sweep, or is being written by another command.
    """

    def __init__(self, path: Path, request: dict[str, Any], wait: bool = False) -> None:
        self.path = path
        self._request = request
        try:
            path.mkdir(parents=True, exist_ok=True)
            _claim(path, request)
            self._journal: BinaryIO = (path / JOURNAL).open('ab+')
        except OSError as error:
            raise SweepError(
                f'--out: {str(path)!r}: {error.strerror}; accepted: a folder that can be written'
            ) from error
        try:
            fcntl.flock(self._journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if not wait:
                self._journal.close()
                raise SweepError(
                    f'--out: {str(path)!r} is being written by another command; '
                    f'accepted: {_ACCEPTED}'
                ) from error
            print(f'khr: {path}: waiting for another command that computes it', file=sys.stderr)
            fcntl.flock(self._journal, fcntl.LOCK_EX)
        self._journal.truncate(_whole(path / JOURNAL))

    def __enter__(self) -> Folder:
        return self

    def __exit__(self, *_: object) -> None:
        self._journal.close()

    def finished(self) -> set[str]:
        """Return the ids of the runs in the journal."""
        return set(self.verdicts())

    def verdicts(self) -> dict[str, str | None]:
        """Return the verdicts of the runs in the journal, by their ids."""
        with (self.path / JOURNAL).open(encoding='utf-8') as lines:
            return {row['id']: row.get('verdict') for row in map(json.loads, lines)}

    def append(self, rows: Iterable[Row]) -> None:
        """Append finished runs; they are on the disk when this returns."""
        for row in rows:
            self._journal.write(json.dumps(row).encode() + b'\n')
        self._journal.flush()
        os.fsync(self._journal.fileno())

    def keep(self, run: str, series: Series) -> None:
        """Write the signals of a run; call it before its row is appended."""
        path = series_path(self.path, run)
        path.parent.mkdir(exist_ok=True)
        series.save(path)

    def export(self) -> Path:
        """Write the journal as a Parquet file; return its path."""
        results, path = self.path / PARQUET, self.path / f'{PARQUET}.part'
        pyarrow.parquet.write_table(_read_journal(self.path, self._request), path)
        path.replace(results)
        return results


def series_path(folder: Path, run: str) -> Path:
    """Return the file of the signals of a run, by its id."""
    return folder / SERIES / f'{run}.npz'


def discard_other(path: Path, request: dict[str, Any]) -> bool:
    """Empty a folder of another sweep or version; return whether it was emptied.

    Raises:
        SweepError: if another command is writing it.
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
        (path / REQUEST).unlink()  # last: a folder emptied halfway is still known as a sweep
    return True


def read_results(path: Path) -> pa.Table:
    """Read the finished runs of a sweep, complete or not, with the request in the metadata.

    Args:
        path: the sweep's folder, or its Parquet file alone.

    Raises:
        SweepError: if there is no sweep.
    """
    try:
        if (path / JOURNAL).is_file():
            return _read_journal(path, json.loads((path / REQUEST).read_text(encoding='utf-8')))
        return pyarrow.parquet.read_table(path / PARQUET if path.is_dir() else path)
    except (OSError, ValueError, pa.ArrowException) as error:
        raise SweepError(
            f'{path}: no results of a sweep; accepted: the folder of a sweep, or its {PARQUET}'
        ) from error


def request_of(results: pa.Table) -> dict[str, Any]:
    """Return the request of the sweep that made the results.

    Raises:
        SweepError: if the results are not from a sweep.
    """
    try:
        request: dict[str, Any] = json.loads(results.schema.metadata[b'khr.sweep'])
        return request
    except (KeyError, TypeError, ValueError) as error:
        raise SweepError('the file is not from a sweep; accepted: results of khr sweep') from error


def _claim(path: Path, request: dict[str, Any]) -> None:
    if not any(path.iterdir()):
        part = path / f'{REQUEST}.part'
        part.write_text(json.dumps(request, indent=1), encoding='utf-8')
        part.replace(path / REQUEST)
    try:
        stored = json.loads((path / REQUEST).read_text(encoding='utf-8'))
    except (FileNotFoundError, ValueError) as error:
        raise SweepError(
            f'--out: {str(path)!r} contains something else; accepted: {_ACCEPTED}'
        ) from error
    for key, value in request.items():
        if stored.get(key) != value:
            raise SweepError(
                f'--out: {str(path)!r} contains a sweep with {_CHANGED[key]}; accepted: {_ACCEPTED}'
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
        results = pyarrow.json.read_json(
            pa.BufferReader(file.read(length)),
            parse_options=pyarrow.json.ParseOptions(
                explicit_schema=schema, unexpected_field_behavior='error'
            ),
        )
    return results.select(schema.names).cast(schema)
