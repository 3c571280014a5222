"""The folder of a run: new or empty, of one run alone, and for this user's eyes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from khr_bringup.errors import BringupError

SCENARIO = 'scenario.yaml'
ACCEPTED = 'accepted: a new or empty folder'


def claim(folder: Path, option: str) -> Path:
    """Make a folder if it is not there, and take it for a run.

    Of several runs that want it at the same moment the one has it that makes its scenario file.

    Raises:
        BringupError: if it holds something, cannot be written, or another run has it;
            ``option`` is what it was given by.
    """
    where = f'{option}: {str(folder)!r}'
    try:
        str(folder).encode()
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise BringupError(f'{where} holds something; {ACCEPTED}')
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        os.close(os.open(folder / SCENARIO, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    except FileExistsError as error:
        raise BringupError(f'{where} has been taken by another run; {ACCEPTED}') from error
    except UnicodeError as error:  # it is to stand in files, and on the lines of processes
        raise BringupError(f'{where} is not accepted; accepted: a path in UTF-8') from error
    except OSError as error:
        raise BringupError(
            f'{where}: {error.strerror}; accepted: a folder that can be written'
        ) from error
    return folder


@contextmanager
def claimed(out: Path | None, name: str) -> Iterator[Path]:
    """Claim a folder, ``runs/NAME-TIME`` by default; leave none behind if nothing has begun.

    Raises:
        BringupError: as :func:`claim`.
    """
    folder = out or Path('runs') / f'{name}-{datetime.now():%Y%m%d-%H%M%S-%f}'[:-3]
    made = not folder.exists()
    claim(folder, '--out')
    try:
        yield folder
    except BaseException:
        with suppress(OSError):
            if not (folder / SCENARIO).stat().st_size:
                (folder / SCENARIO).unlink()
                if made:
                    folder.rmdir()
        raise
