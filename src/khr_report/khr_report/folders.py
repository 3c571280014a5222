"""Output folders of commands."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryFile

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
