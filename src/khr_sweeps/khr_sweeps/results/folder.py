"""The folder of a sweep: its finished runs and their signals.

``rows.sqlite`` has the specification of the sweep and a row for each finished run
(:mod:`khr_sweeps.results.store`). ``results.parquet`` has the same rows; it is written when the
sweep is complete or interrupted. ``series/`` has the signals of the runs if the sweep keeps them.
They are written before the row of their run; a run with lost or damaged signals is repeated.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Container, Iterable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from khr_bringup.recorded.run_signals import Series
from khr_common.errors import KhrError
from khr_common.files import written
from khr_sweeps.axes import column_named
from khr_sweeps.results.store import BusyError, OtherResultsError, Store, read_store
from khr_sweeps.trial import RESULTS, Row

ROWS, PARQUET, SERIES = 'rows.sqlite', 'results.parquet', 'series'
_TYPES = {bool: pa.bool_(), int: pa.int64(), float: pa.float64(), str: pa.string()}
_CHANGED = {
    'version': 'another version of the project',
    'scenario': 'another scenario',
    'cases': 'other cases',
    'axes': 'other axes',
    'samples': 'another number of samples',
    'seeds': 'another number of seeds',
    'keep': 'other signals to keep',
    'bisect': 'another bisection',
}
_ACCEPTED = 'a new or empty folder, or the folder of the same sweep'


class Folder:
    """A sweep's folder, open for one writer.

    Args:
        path: the folder; it is made if needed.
        request: all that determines the runs of the sweep: the result of :meth:`Sweep.record
            <khr_sweeps.specification.Sweep.record>`, and the version of the code.
        wait: whether to wait, with a message, while another command writes the folder.
        replace: whether to remove the runs of another sweep or version.

    Attributes:
        replaced: whether runs of another sweep or version were removed.

    Raises:
        KhrError: if the folder cannot be written, contains another sweep or other files, or is
            being written by another command.
    """

    def __init__(
        self, path: Path, request: dict[str, Any], wait: bool = False, replace: bool = False
    ) -> None:
        self.path, self._keeps = path, bool(request.get('keep'))
        try:
            path.mkdir(parents=True, exist_ok=True)
            _check_place(path)
            self._rows = Store(path / ROWS, request, self._stayed_up, wait, replace)
        except OtherResultsError as error:
            found = (
                f'a sweep with {_CHANGED.get(error.key, "another definition")}'
                if error.key
                else 'something else, or damaged results'
            )
            raise KhrError(
                f'--out: {str(path)!r} contains {found}; accepted: {_ACCEPTED}'
            ) from error
        except BusyError as error:
            raise KhrError(
                f'--out: {str(path)!r} is being written by another command; accepted: {_ACCEPTED}'
            ) from error
        except OSError as error:
            raise KhrError(
                f'--out: {str(path)!r}: {error.strerror}; accepted: a folder that can be written'
            ) from error
        self.replaced = self._rows.replaced
        if self.replaced:
            shutil.rmtree(path / SERIES, ignore_errors=True)
            (path / PARQUET).unlink(missing_ok=True)

    def __enter__(self) -> Folder:
        return self

    def __exit__(self, *_: object) -> None:
        self._rows.close()

    def finished(self) -> dict[str, bool | None]:
        """Return the finished runs: whether the robot stayed up, by run id; None if refused."""
        return dict(self._rows.values)

    def append(self, rows: Iterable[Row]) -> None:
        """Append finished runs; they are on the disk when this returns."""
        self._rows.add({row['id']: row for row in rows})

    def keep(self, run: str, series: Series) -> None:
        """Write the signals of a run; call it before its row is appended."""
        path = series_path(self.path, run)
        path.parent.mkdir(exist_ok=True)
        series.save(path)

    def export(self) -> Path:
        """Write the rows as a Parquet file; return its path."""
        path = self.path / PARQUET
        with written(path) as part:
            pyarrow.parquet.write_table(_read_rows(self.path), part)
        return path

    def _stayed_up(self, row: Row) -> bool | None:
        """Return whether the robot stayed up; None if the run was refused.

        Raises:
            ValueError: if the signals of the run are lost or damaged.
        """
        up: bool | None = row['stayed_up']
        if self._keeps and up is not None:
            try:
                Series.load(series_path(self.path, row['id']))
            except KhrError as error:
                raise ValueError(str(error)) from error
        return up


def series_path(folder: Path, run: str) -> Path:
    """Return the file of the signals of a run, by its id."""
    return folder / SERIES / f'{run}.npz'


def read_results(path: Path) -> pa.Table:
    """Read the finished runs of a sweep, complete or not, with the request in the metadata.

    Args:
        path: the sweep's folder, or its Parquet file alone.

    Raises:
        KhrError: if there is no sweep, or one of another version with other columns.
    """
    try:
        if (path / ROWS).is_file():
            return _read_rows(path)
        return pyarrow.parquet.read_table(path / PARQUET if path.is_dir() else path)
    except (OSError, ValueError, OtherResultsError, pa.ArrowException) as error:
        raise KhrError(
            f'{path}: no results of a sweep; accepted: the folder of a sweep, or its {PARQUET}'
        ) from error


def request_of(results: pa.Table) -> dict[str, Any]:
    """Return the request of the sweep that made the results.

    Raises:
        KhrError: if the results are not from a sweep, or lack a column of this version.
    """
    try:
        request: dict[str, Any] = json.loads(results.schema.metadata[b'khr.sweep'])
        names = results.column_names
    except (KeyError, TypeError, ValueError) as error:
        raise KhrError('the file is not from a sweep; accepted: results of khr sweep') from error
    _check_columns(names)
    return request


def _check_place(path: Path) -> None:
    """Refuse a folder with other files; accept empty files and parts of a killed command."""
    others = [
        each
        for each in path.iterdir()
        if each.name not in (ROWS, f'{ROWS}-journal', PARQUET, SERIES)
        and not each.name.startswith('.')
        and not each.name.endswith('.part')
        and (each.is_dir() or each.stat().st_size)
    ]
    if others and not (path / ROWS).is_file():
        raise OtherResultsError(path)


def _check_columns(columns: Container[str]) -> None:
    for name in RESULTS:
        if name not in columns:
            raise KhrError(
                f'the results lack the column {name!r}; accepted: those of this version of the '
                'project, so repeat the sweep in a new folder'
            )


def _read_rows(path: Path) -> pa.Table:
    request, rows = read_store(path / ROWS, dict)
    if rows:
        _check_columns(rows[0])
    swept = {name: column_named(name) for name in request['axes']}
    types = {
        'id': pa.string(),
        **{
            name: pa.list_(_TYPES[one.element]) if one.element else _TYPES[one.kind]
            for name, one in swept.items()
        },
        'seed': pa.int64(),
        **{name: _TYPES[kind] for name, kind in RESULTS.items()},
    }
    schema = pa.schema(list(types.items()), metadata={'khr.sweep': json.dumps(request)})
    return pa.Table.from_pylist(rows, schema)
