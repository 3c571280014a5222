"""No process outlives the one that started it, however that one ends."""

from __future__ import annotations

import ctypes
import os
import signal

PARENT = 'KHR_PARENT'  # environment variable: the process that a child must not outlive
_PR_SET_PDEATHSIG = 1  # prctl(2)


def end_with_parent(number: int = signal.SIGKILL) -> None:
    """Have the kernel end this process when its parent dies; nothing if no parent is named.

    The parent states its number in the environment, so that one which died before this call is
    noticed as well. The request survives an exec, and SIGKILL ends a stopped process too.

    Args:
        number: the signal; a process that has to close what it writes takes SIGTERM.
    """
    parent = os.environ.get(PARENT)
    if parent is None:
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
    if str(os.getppid()) != parent:
        os.kill(os.getpid(), number)
