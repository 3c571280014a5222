"""Results in a SQLite file, by id: a result in it is not computed again.

Results are added in transactions, so a command that is killed loses only its running jobs. Each
result has a checksum: a damaged one is dropped and computed again. Reading runs no code.
"""

from __future__ import annotations

import fcntl
import json
import os
import sqlite3
import sys
import zlib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import Any, Generic, TextIO, TypeVar

from khr_common import RunError
from khr_common.errors import KhrError

Kept = TypeVar('Kept')
HEAD = ''  # id of the entry that states what determines the results
TIMEOUT = 60.0  # s to wait for the transaction of another process
_UNREADABLE = sqlite3.Error, UnicodeDecodeError  # the latter of a damaged name of a column
_TABLE = 'CREATE TABLE results (id TEXT PRIMARY KEY, data TEXT, sum INT)'
_ADD = 'INSERT OR REPLACE INTO results VALUES (?, ?, ?)'


class OtherResultsError(KhrError):
    """A file with results of another computation, or one that cannot be read.

    Attributes:
        key: the first entry of the head that differs; '' if the head cannot be read.
        there, here: its values in the file and in this computation.
    """

    def __init__(self, path: Path, key: str = '', there: Any = None, here: Any = None) -> None:
        found = (
            f'results of another computation ({key}: {there!r}, now {here!r})'
            if key
            else 'no results of khr, or damaged'
        )
        super().__init__(f'{path}: {found}; accepted: another place, or the same computation')
        self.key, self.there, self.here = key, there, here


class BusyError(KhrError):
    """A file of results that another command is writing."""


class Store(Generic[Kept]):
    """A file of results, open for one writer.

    Args:
        path: the file; its folder exists.
        head: all that determines the results, as plain data.
        accept: converts the stored data of a result; if it raises ValueError or LookupError, the
            result counts as damaged.
        wait: whether to wait, with a message, while another command writes the file.
        replace: whether to remove results of another computation.

    Attributes:
        values: the converted results by id, in the order in which they were added.
        replaced: whether results of another computation were removed.

    Raises:
        OtherResultsError: if the file has results of another computation, or is no such file.
        BusyError: if another command is writing the file.
        OSError: if the file cannot be written.
    """

    def __init__(
        self,
        path: Path,
        head: dict[str, Any],
        accept: Callable[[Any], Kept],
        wait: bool = False,
        replace: bool = False,
    ) -> None:
        self.path, self.replaced = path, False
        self.values: dict[str, Kept] = {}
        self._accept, self._threads = accept, Lock()
        self._lock_file = _lock(path, wait)
        self._database: sqlite3.Connection | None = None
        try:
            if not path.exists():
                _create(path, head)
            path.open('ab').close()  # raises OSError with the reason, which SQLite does not name
            self._database = _connect(path)
            self._load(self._database, json.loads(json.dumps(head)), replace)
        except _UNREADABLE as error:
            self.close()
            raise OtherResultsError(path) from error
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Store[Kept]:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; results that are added later are dropped."""
        with self._threads:
            if self._database is not None:
                self._database.close()
                self._database = None
            if not self._lock_file.closed:
                Path(self._lock_file.name).unlink(missing_ok=True)
                self._lock_file.close()

    def add(self, results: Mapping[str, Any]) -> None:
        """Add plain data by id; it is on the disk when this returns.

        Raises:
            RunError: if the data cannot be written.
        """
        with self._threads:
            if self._database is None:
                return
            try:
                with self._database:
                    self._database.executemany(_ADD, map(_row, results.items()))
            except sqlite3.Error as error:
                raise RunError(f'{self.path}: {error}; finished results are kept') from error
            self.values.update((id_, self._accept(data)) for id_, data in results.items())

    def _load(self, database: sqlite3.Connection, head: dict[str, Any], replace: bool) -> None:
        with database:
            if not database.execute('SELECT * FROM sqlite_master').fetchall():
                database.execute(_TABLE)
            there, values, damaged = _read(database, self._accept)
            if there != head and (there is not None or values or damaged):
                if not replace:
                    raise _other(self.path, there, head)
                database.execute('DELETE FROM results')
                values, damaged, self.replaced = {}, [], True
            database.executemany('DELETE FROM results WHERE rowid = ?', damaged)
            if there != head:
                database.execute(_ADD, _row((HEAD, head)))
        self.values = values
        _report(self.path, len(damaged))


def read_store(path: Path, accept: Callable[[Any], Kept]) -> tuple[dict[str, Any], list[Kept]]:
    """Read the head and the results of a file, also while another command writes it.

    Raises:
        OtherResultsError: if it is not a file of results.
    """
    try:
        database = _connect(path, 'rw')  # a transaction of a killed command is rolled back
        try:
            head, values, damaged = _read(database, accept)
        finally:
            database.close()
    except _UNREADABLE as error:
        raise OtherResultsError(path) from error
    if not isinstance(head, dict):
        raise OtherResultsError(path)
    _report(path, len(damaged))
    return head, list(values.values())


def _create(path: Path, head: dict[str, Any]) -> None:
    """Create a file without results; whoever reads it meanwhile finds all of it or no file."""
    new = path.with_name(f'.{path.name}.new')
    new.write_bytes(b'')
    database = _connect(new)
    with database:
        database.execute(_TABLE)
        database.execute(_ADD, _row((HEAD, head)))
    database.close()
    new.replace(path)


def _connect(path: Path, mode: str = 'rwc') -> sqlite3.Connection:
    database = sqlite3.connect(
        f'{path.absolute().as_uri()}?mode={mode}', TIMEOUT, check_same_thread=False, uri=True
    )
    database.text_factory = bytes  # damaged text is not UTF-8
    database.execute('PRAGMA trusted_schema = OFF')
    return database


def _read(
    database: sqlite3.Connection, accept: Callable[[Any], Kept]
) -> tuple[Any, dict[str, Kept], list[tuple[int]]]:
    """Return the head, the converted results by id, and the rows of damaged entries."""
    head, values, damaged = None, {}, []
    rows = database.execute('SELECT rowid, id, data, sum FROM results ORDER BY rowid')
    for row, id_, data, checksum in rows:
        try:
            if checksum != zlib.crc32(id_ + data):
                raise ValueError('checksum')
            if id_ == HEAD.encode():
                head = json.loads(data)
            else:
                values[id_.decode()] = accept(json.loads(data))
        except (TypeError, ValueError, LookupError):
            damaged.append((row,))
    return head, values, damaged


def _row(result: tuple[str, Any]) -> tuple[str, str, int]:
    id_, data = result[0], json.dumps(result[1], separators=(',', ':'))
    return id_, data, zlib.crc32((id_ + data).encode())


def _other(path: Path, there: Any, here: dict[str, Any]) -> OtherResultsError:
    if not isinstance(there, dict):
        return OtherResultsError(path)
    key = next(key for key in {**here, **there} if there.get(key) != here.get(key))
    return OtherResultsError(path, key, there.get(key), here.get(key))


def _report(path: Path, damaged: int) -> None:
    if damaged:
        print(
            f'khr: {path}: {damaged} damaged result{"s" * (damaged > 1)} dropped', file=sys.stderr
        )


def _lock(path: Path, wait: bool) -> TextIO:
    """Lock a file beside the results: a lock of the results would interfere with SQLite's own."""
    lock_path = path.with_name(f'.{path.name}.lock')
    while True:
        file = lock_path.open('w')
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if not wait:
                file.close()
                raise BusyError(f'{path}: another command is writing it') from error
            print(f'khr: {path}: waiting for another command that computes it', file=sys.stderr)
            fcntl.flock(file, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(file.fileno()), lock_path.stat()):
                return file
        file.close()  # the other command has removed it meanwhile
