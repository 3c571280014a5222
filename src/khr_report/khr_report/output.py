"""Output of commands: pages, folders, and values as CSV."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from contextlib import suppress
from io import StringIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from khr_common.errors import KhrError


def make_folder(out: Path, option: str = '--out') -> None:
    """Make a folder, and check that it can be written."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise KhrError(
            f'{option}: {str(out)!r}: {error.strerror}; accepted: a folder that can be written'
        ) from error


def check_folder(out: Path, option: str = '--out') -> None:
    """Check before minutes of measuring that a folder can be made and written; leave none."""
    new = [each for each in (out, *out.parents) if not each.exists()]
    try:
        make_folder(out, option)
    finally:
        for each in new:
            with suppress(OSError):  # not made, or written to by another process
                each.rmdir()


def check_file(file: Path, *suffixes: str, option: str = '--out') -> None:
    """Check before minutes of measuring that a file with one of these suffixes can be written."""
    accepted = f'a name in {" or ".join(suffixes)}'
    if file.is_dir():
        raise KhrError(f'{option}: {str(file)!r} is a folder; accepted: {accepted}')
    if file.suffix not in suffixes:
        raise KhrError.refused(option, str(file), accepted)
    check_folder(file.parent, option)


def check_page(page: Path, option: str = '--out') -> None:
    """Check, as :func:`check_file`, that a page can be written.

    Its data and pictures are files of the same stem beside it; under the name of one of them the
    page would overwrite it.
    """
    check_file(page, '.md', option=option)


def csv_text(head: Iterable[str], rows: Iterable[Iterable[Any]], digits: int) -> str:
    """Write rows as comma-separated values below their heads, numbers with so many digits."""
    text = StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    for row in rows:
        writer.writerow(f'{one:.{digits}g}' if isinstance(one, float) else one for one in row)
    return text.getvalue()
