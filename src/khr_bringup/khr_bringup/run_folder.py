"""The folder of a run: new or empty, for one run, readable by this user alone."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from khr_common.errors import KhrError

SCENARIO = 'scenario.yaml'
ACCEPTED = 'accepted: a new or empty folder'
_locks: dict[Path, int] = {}  # descriptors, by the folder that this process has claimed


def claim(folder: Path, option: str) -> Path:
    """Create a folder if necessary, and claim it for a run.

    Of several runs that claim it at once, the one that locks its scenario file gets it. A run that
    was killed before it had written that file leaves it empty and unlocked: the folder is free.

    Raises:
        KhrError: if it holds something, cannot be written, or another run has it;
            ``option`` names its source in the text.
    """
    where = f'{option}: {str(folder)!r}'
    try:
        str(folder).encode()
        if folder.exists() and not _empty(folder):
            raise KhrError(f'{where} holds something; {ACCEPTED}')
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        lock = _lock(folder / SCENARIO)
        if not _empty(folder):
            os.close(lock)
            raise FileExistsError
        _locks[folder] = lock
    except (BlockingIOError, FileExistsError, FileNotFoundError) as error:
        raise KhrError(f'{where} has been taken by another run; {ACCEPTED}') from error
    except UnicodeError as error:  # it is to stand in files, and on the lines of processes
        raise KhrError(f'{where} is not accepted; accepted: a path in UTF-8') from error
    except OSError as error:
        raise KhrError(
            f'{where}: {error.strerror}; accepted: a folder that can be written'
        ) from error
    return folder


def of_robot(stem: str, namespace: str) -> str:
    """Return the stem of a file about one robot of several, such as ``report_blue``."""
    return '_'.join([stem, *filter(None, namespace.split('/'))])


def _lock(file: Path) -> int:
    """Make a file if it is not there, lock it, and return its descriptor.

    Raises:
        BlockingIOError: if another run has locked it.
        FileExistsError: if another file has taken its place meanwhile.
    """
    lock = os.open(file, os.O_CREAT | os.O_WRONLY, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if not os.path.samestat(os.fstat(lock), os.stat(file)):
            raise FileExistsError
    except OSError:
        os.close(lock)
        raise
    return lock


def _empty(folder: Path) -> bool:
    """Return whether a folder is empty, or holds only remains of an interrupted claim."""
    return folder.is_dir() and all(
        each.name == SCENARIO and not each.stat().st_size for each in folder.iterdir()
    )


@contextmanager
def claim_folder(out: Path | None, name: str) -> Iterator[Path]:
    """Claim a folder, ``runs/NAME-TIME`` by default; remove it again if no run has started."""
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
    finally:
        os.close(_locks.pop(folder))
