"""Results in a file that grows by a line each: what is there is not computed again.

A line is a JSON object with an ``id`` and, as its last member, a checksum over itself and the first
line, which says what all results belong to. So a line that was damaged, changed, or taken from
another computation is noticed: it is left out, by name, and computed again. A command that is
killed leaves at worst a torn last line. Nothing that is read can run.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Lock
from typing import Any, BinaryIO, Generic, NamedTuple, TypeVar

from khr_common import RunError
from khr_sweeps.errors import SweepError

Entry = dict[str, Any]
Kept = TypeVar('Kept')
_SUM = b', "sum": "%s"}\n'
_LENGTH = 16  # hexadecimal digits of a checksum
_NAMED = 5  # damaged lines named by their numbers


class OtherResultsError(SweepError):
    """A file of results of something else; ``key`` says what differs, '' if all does."""

    def __init__(self, path: Path, key: str = '', there: Any = None, here: Any = None) -> None:
        said = (
            f'of another computation ({key}: {there!r}, now {here!r})' if key else 'something else'
        )
        super().__init__(f'{path}: {said}; accepted: another place, or the same computation')
        self.key, self.there, self.here = key, there, here


class BusyError(SweepError):
    """A file of results that another command is writing."""


class Store(Generic[Kept]):
    """A file of results, open for one writer.

    Args:
        path: the file; its folder exists.
        head: all that decides the results, as plain data.
        accept: reads an entry; what it raises ValueError for is left out as damaged.
        wait: whether to wait for another command that is writing it; it says so.
        replace: whether results of something else are removed.

    Attributes:
        values: what ``accept`` returned, by id.
        replaced: whether results of something else were removed.

    Raises:
        OtherResultsError: if the file holds something else.
        BusyError: if another command is writing it.
        OSError: if it cannot be written.
    """

    def __init__(
        self,
        path: Path,
        head: Entry,
        accept: Callable[[Entry], Kept],
        wait: bool = False,
        replace: bool = False,
    ) -> None:
        self.path, self.replaced = path, False
        self.values: dict[str, Kept] = {}
        self._accept, self._lock = accept, Lock()
        self._file = _locked(path, wait)
        self._head = _line(head, b'')
        try:
            self._load(json.loads(json.dumps(head)), replace)
        except BaseException:
            self._file.close()
            raise

    def __enter__(self) -> Store[Kept]:
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._file.close()

    def add(self, entries: Iterable[Entry]) -> None:
        """Append entries; they are on the disk when this returns. Nothing after the end.

        Raises:
            RunError: if the disk does not take them.
        """
        some = list(entries)
        with self._lock:
            if self._file.closed:
                return
            before = self._file.seek(0, os.SEEK_END)
            try:
                self._file.write(b''.join(_line(entry, self._head) for entry in some))
                self._file.flush()
                os.fsync(self._file.fileno())
            except OSError as error:
                with suppress(OSError):
                    self._file.truncate(before)
                raise RunError(
                    f'{self.path}: {error.strerror}; what is finished is kept'
                ) from error
            self.values.update((entry['id'], self._accept(entry)) for entry in some)

    def _load(self, head: Entry, replace: bool) -> None:
        content = self._file.read()
        first, lines = _lines(content)
        there = _entry(first, b'')
        read = _read(lines, self._head, self._accept)
        if there != head and not read.good and not self._head.startswith(content):
            if not replace:
                raise _other(self.path, there, head)
            read, self.replaced = _Read([], []), True
        self.values = {id_: value for id_, value, _ in read.good}
        _name(self.path, read.damaged)
        wanted = self._head + b''.join(line for _, _, line in read.good)
        if content != wanted:
            self._write_anew(wanted)

    def _write_anew(self, content: bytes) -> None:
        """Put a file with other content into the place of this one, and hold it as well."""
        part, old = self.path.with_name(f'.{self.path.name}.part'), self._file
        self._file = part.open('w+b')
        fcntl.flock(self._file, fcntl.LOCK_EX)
        self._file.write(content)
        self._file.flush()
        os.fsync(self._file.fileno())
        part.replace(self.path)
        old.close()


def read_store(path: Path, accept: Callable[[Entry], Kept]) -> tuple[Entry, list[Kept]]:
    """Read head and results of a file that may be written meanwhile.

    Raises:
        SweepError: if it is no file of results.
        OSError: if it cannot be read.
    """
    first, lines = _lines(path.read_bytes())
    head = _entry(first, b'')
    if head is None:
        raise OtherResultsError(path)
    read = _read(lines, first, accept)
    _name(path, read.damaged)
    return head, list({id_: value for id_, value, _ in read.good}.values())


def _lines(content: bytes) -> tuple[bytes, list[bytes]]:
    """Return the first line and the others, without what was torn off at the end."""
    lines = [line + b'\n' for line in content.split(b'\n')[:-1]]
    return (lines[0], lines[1:]) if lines else (b'', [])


def _other(path: Path, there: Entry | None, here: Entry) -> OtherResultsError:
    if there is None:
        return OtherResultsError(path)
    key = next(key for key in {**here, **there} if there.get(key) != here.get(key))
    return OtherResultsError(path, key, there.get(key), here.get(key))


class _Read(NamedTuple):
    """Good lines, each with its id and what was accepted of it, and the numbers of the others."""

    good: list[tuple[str, Any, bytes]]
    damaged: list[int]


def _read(lines: Sequence[bytes], head: bytes, accept: Callable[[Entry], Any]) -> _Read:
    read = _Read([], [])
    for number, line in enumerate(lines, 2):
        entry = _entry(line, head)
        try:
            if entry is None:
                raise ValueError
            read.good.append((entry['id'], accept(entry), line))
        except (ValueError, KeyError):
            read.damaged.append(number)
    return read


def _name(path: Path, damaged: Sequence[int]) -> None:
    if damaged:
        numbers = ', '.join(map(str, damaged[:_NAMED]))
        more = f' and {len(damaged) - _NAMED} more' if len(damaged) > _NAMED else ''
        print(
            f'khr: {path}: damaged, incomplete, or of another computation, and left out: '
            f'line {numbers}{more}',
            file=sys.stderr,
        )


def _line(entry: Entry, head: bytes) -> bytes:
    body = json.dumps(entry).encode()
    return body[:-1] + _SUM % _checksum(body, head)


def _entry(line: bytes, head: bytes) -> Entry | None:
    """Return the entry of a line; None if it is not as it was written below this head."""
    end = len(_SUM) - len('%s') + _LENGTH
    body = line[:-end] + b'}'
    if line[-end:] != _SUM % _checksum(body, head):
        return None
    try:
        entry = json.loads(body)
    except ValueError:  # a checksum over no JSON
        return None
    return entry if isinstance(entry, dict) else None


def _checksum(body: bytes, head: bytes) -> bytes:
    return hashlib.sha256(head + body).hexdigest()[:_LENGTH].encode()


def _locked(path: Path, wait: bool) -> BinaryIO:
    while True:
        file = path.open('a+b')
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if not wait:
                file.close()
                raise BusyError(f'{path}: another command is writing it') from error
            print(f'khr: {path}: waiting for another command that computes it', file=sys.stderr)
            fcntl.flock(file, fcntl.LOCK_EX)
        if os.fstat(file.fileno()).st_ino == path.stat().st_ino:
            file.seek(0)
            return file
        file.close()  # it was replaced meanwhile
