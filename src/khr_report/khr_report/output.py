"""Output of commands: folders, and values as CSV."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from io import StringIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from khr_common.errors import KhrError


def make_folder(out: Path) -> None:
    """Make a folder, and check before minutes of measuring that it can be written."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise KhrError(
            f'--out: {str(out)!r}: {error.strerror}; accepted: a folder that can be written'
        ) from error


def csv_text(head: Iterable[str], rows: Iterable[Iterable[Any]], digits: int) -> str:
    """Write rows as comma-separated values below their heads, numbers with so many digits."""
    text = StringIO()
    writer = csv.writer(text)
    writer.writerow(head)
    for row in rows:
        writer.writerow(f'{one:.{digits}g}' if isinstance(one, float) else one for one in row)
    return text.getvalue()
