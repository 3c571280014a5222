"""The folder of a sweep: its finished runs and their signals.

``rows.jsonl`` begins with what defines the runs of the sweep and grows by a line per finished run
(:mod:`khr_sweeps.results.store`). ``results.parquet`` has the same rows, written when the sweep is
complete or interrupted. ``series/`` has the signals of the runs if the sweep keeps them; they are
written before the line of their run, and a run whose signals are lost or damaged is run again.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Container, Iterable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from khr_bringup.errors import BringupError
from khr_bringup.recorded.run_signals import Series
from khr_common.files import written
from khr_sweeps.axes import column_named
from khr_sweeps.errors import SweepError
from khr_sweeps.results.store import BusyError, OtherResultsError, Store, read_store
from khr_sweeps.trial import RESULTS, Row

JOURNAL, PARQUET, SERIES = 'rows.jsonl', 'results.parquet', 'series'
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
        replace: whether the runs of another sweep or version are removed.

    Attributes:
        replaced: whether runs of another sweep or version were removed.

    Raises:
        SweepError: if the folder cannot be written, contains something else or another
            sweep, or is being written by another command.
    """

    def __init__(
        self, path: Path, request: dict[str, Any], wait: bool = False, replace: bool = False
    ) -> None:
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True)
            _check_place(path)
            kinds, keeps = _kinds(request), request.get('keep')

            def accept(row: Row) -> bool | None:
                up = _stayed_up(row, kinds)
                if keeps and up is not None:
                    _check_series(series_path(path, row['id']))
                return up

            self._rows = Store(path / JOURNAL, request, accept, wait, replace)
        except OtherResultsError as error:
            what = (
                f'a sweep with {_CHANGED.get(error.key, "another definition")}'
                if error.key
                else 'something else'
            )
            raise SweepError(
                f'--out: {str(path)!r} contains {what}; accepted: {_ACCEPTED}'
            ) from error
        except BusyError as error:
            raise SweepError(
                f'--out: {str(path)!r} is being written by another command; accepted: {_ACCEPTED}'
            ) from error
        except OSError as error:
            raise SweepError(
                f'--out: {str(path)!r}: {error.strerror}; accepted: a folder that can be written'
            ) from error
        self.replaced = self._rows.replaced
        if self.replaced:
            shutil.rmtree(path / SERIES, ignore_errors=True)
            (path / PARQUET).unlink(missing_ok=True)

    def __enter__(self) -> Folder:
        return self

    def __exit__(self, *error: object) -> None:
        self._rows.__exit__(*error)

    def finished(self) -> dict[str, bool | None]:
        """Return the finished runs by id: whether the robot stayed up; None if refused."""
        return dict(self._rows.values)

    def append(self, rows: Iterable[Row]) -> None:
        """Append finished runs; they are on the disk when this returns."""
        self._rows.add(rows)

    def keep(self, run: str, series: Series) -> None:
        """Write the signals of a run; call it before its row is appended."""
        path = series_path(self.path, run)
        path.parent.mkdir(exist_ok=True)
        series.save(path)

    def export(self) -> Path:
        """Write the journal as a Parquet file; return its path."""
        path = self.path / PARQUET
        with written(path) as part:
            pyarrow.parquet.write_table(_read_journal(self.path), part)
        return path


def series_path(folder: Path, run: str) -> Path:
    """Return the file of the signals of a run, by its id."""
    return folder / SERIES / f'{run}.npz'


def read_results(path: Path) -> pa.Table:
    """Read the finished runs of a sweep, complete or not, with the request in the metadata.

    Args:
        path: the sweep's folder, or its Parquet file alone.

    Raises:
        SweepError: if there is no sweep, or one of another version with other columns.
    """
    try:
        if (path / JOURNAL).is_file():
            return _read_journal(path)
        return pyarrow.parquet.read_table(path / PARQUET if path.is_dir() else path)
    except (OSError, ValueError, OtherResultsError, pa.ArrowException) as error:
        raise SweepError(
            f'{path}: no results of a sweep; accepted: the folder of a sweep, or its {PARQUET}'
        ) from error


def request_of(results: pa.Table) -> dict[str, Any]:
    """Return the request of the sweep that made the results.

    Raises:
        SweepError: if the results are not from a sweep, or lack a column of this version.
    """
    try:
        request: dict[str, Any] = json.loads(results.schema.metadata[b'khr.sweep'])
        names = results.column_names
    except (KeyError, TypeError, ValueError) as error:
        raise SweepError('the file is not from a sweep; accepted: results of khr sweep') from error
    _check_columns(names)
    return request


def _check_place(path: Path) -> None:
    """Refuse a folder with other files; what a killed command began or left empty may be there."""
    others = [
        each
        for each in path.iterdir()
        if each.name not in (JOURNAL, PARQUET, SERIES)
        and not each.name.startswith('.')
        and not each.name.endswith('.part')
        and (each.is_dir() or each.stat().st_size)
    ]
    if others and not (path / JOURNAL).is_file():
        raise OtherResultsError(path)


def _kinds(request: dict[str, Any]) -> dict[str, type | list[type]]:
    """Return the type of each column, in a list if it holds lists of it."""
    swept = {name: column_named(name) for name in request['axes']}
    return {
        'id': str,
        **{name: [one.element] if one.element else one.kind for name, one in swept.items()},
        'seed': int,
        **RESULTS,
    }


def _stayed_up(row: Row, kinds: dict[str, type | list[type]]) -> bool | None:
    """Return whether the robot stayed up; None if the run was refused.

    Raises:
        ValueError: if the row has other columns, or a value of another type.
    """
    if row.keys() != kinds.keys() or row['id'] is None:
        raise ValueError('other columns')
    for name, kind in kinds.items():
        given = row[name]
        values = given if isinstance(kind, list) and isinstance(given, list) else [given]
        expected = kind[0] if isinstance(kind, list) else kind
        if given is not None and not all(type(value) is expected for value in values):
            raise ValueError(f'{name}: {given!r}')
    up: bool | None = row['stayed_up']
    return up


def _check_series(path: Path) -> None:
    """Raise ValueError if the signals of a run are not there or damaged: it is then run again."""
    try:
        Series.load(path)
    except BringupError as error:
        raise ValueError(str(error)) from error


def _check_columns(columns: Container[str]) -> None:
    for name in RESULTS:
        if name not in columns:
            raise SweepError(
                f'the results lack the column {name!r}; accepted: those of this version of the '
                'project, so repeat the sweep in a new folder'
            )


def _read_journal(path: Path) -> pa.Table:
    request, rows = read_store(path / JOURNAL, lambda row: row)
    if rows:
        _check_columns(rows[0])
    columns = {
        name: pa.list_(_TYPES[kind[0]]) if isinstance(kind, list) else _TYPES[kind]
        for name, kind in _kinds(request).items()
    }
    schema = pa.schema(list(columns.items()), metadata={'khr.sweep': json.dumps(request)})
    return pa.Table.from_pylist(rows, schema)
