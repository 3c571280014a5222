"""Files that are whole or not there."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from khr_common.errors import KhrError, RunError

_MISTYPED = (errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.ENAMETOOLONG)


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """Yield a path beside ``path`` to write to; the file takes its place when the block ends.

    The path has the same suffix. If the block raises, nothing is left of it.

    Raises:
        KhrError: if there is no such folder.
        RunError: if the folder or the disk does not take the file.
    """
    part = path.with_name(f'.{os.getpid()}-{path.name}')
    try:
        yield part
        with part.open('rb') as file:
            os.fsync(file.fileno())
        part.replace(path)
    except KhrError as error:
        raise type(error)(str(error).replace(part.name, path.name)) from error
    except OSError as error:
        kind = KhrError if error.errno in _MISTYPED else RunError
        text = str(error.strerror or error).replace(part.name, path.name)
        raise kind(f'{str(path)!r}: {text}; accepted: a file that can be written') from error
    finally:
        part.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text in UTF-8.

    Raises:
        KhrError, RunError: as :func:`written`.
    """
    with written(path) as part:
        part.write_text(text, encoding='utf-8')
