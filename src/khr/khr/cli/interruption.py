"""An interruption is raised where it is not lost: Python raises it between any two steps.

It is lost in an import, where C extensions and classes that are being made drop or replace what is
raised in them, in a destructor and in the callback of a weak reference; a lock is left held if it
comes in ``__enter__`` or ``__exit__``. There it waits.
"""

from __future__ import annotations

import atexit
import os
import signal
import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

from khr_common.errors import INTERRUPTED

AGAIN = 0.02  # s of wall time until an interruption that waits is tried again
_IMPORTS = '<frozen importlib._bootstrap'  # file of the frames of an import
_VERBS = 'khr.cli.verbs.'  # modules that import what they need first
_LOCKS = '__enter__', '__exit__'
_report_other = sys.unraisablehook

Handler = Callable[[int, FrameType | None], None]


def on_signals(handler: Handler) -> None:
    """Take the signals that ask a process to end; SIGINT and SIGHUP may be ignored."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if number == signal.SIGTERM or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def leave_at_once(*_: object) -> None:
    """End without a word of what was interrupted: nothing has begun."""
    os.write(2, b'khr: interrupted\n')
    os._exit(INTERRUPTED)


def interrupt(_: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, now or where it is not lost; leave at once if nothing has begun."""
    importer = _importer(frame)
    if importer.startswith(_VERBS):
        leave_at_once()
    if importer or (frame is not None and frame.f_code.co_name in _LOCKS):
        _wait()
    else:
        raise KeyboardInterrupt


def keep_interruptions() -> None:
    """Have those that wait raised later, and those that a destructor has dropped once more."""
    sys.unraisablehook = _report
    atexit.register(signal.setitimer, signal.ITIMER_REAL, 0.0)  # it would end Python as that ends


def _importer(frame: FrameType | None) -> str:
    """Return the name of the module whose import goes on, the outermost; empty if none does."""
    name = ''
    while frame is not None:
        if frame.f_code.co_filename.startswith(_IMPORTS) and frame.f_back is not None:
            name = frame.f_back.f_globals.get('__name__', '?')
        frame = frame.f_back
    return name


def _report(dropped: Any) -> None:
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        _wait()
    else:
        _report_other(dropped)


def _wait() -> None:
    signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, AGAIN)
