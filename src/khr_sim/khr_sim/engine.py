"""The physics engine, imported without the line that it prints on standard output."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def _silent_stdout() -> Iterator[None]:
    """Send what C code writes to file descriptor 1 nowhere."""
    kept = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 1)
        yield
    finally:
        ctypes.CDLL(None).fflush(None)  # the line waits in C's own buffer
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nowhere)


with _silent_stdout():
    import pybullet as bullet

__all__ = ['bullet']
