"""The khr command."""

from __future__ import annotations

import sys
from types import TracebackType


def _one_line(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """Report a library that cannot be loaded, as under a limit of memory, in one line."""
    if issubclass(kind, ImportError | MemoryError):
        print(f'khr: {kind.__name__}: {" ".join(str(error).split())}', file=sys.stderr)
    elif issubclass(kind, KeyboardInterrupt):
        print('khr: interrupted', file=sys.stderr)
    else:
        sys.__excepthook__(kind, error, trace)


sys.excepthook = _one_line
