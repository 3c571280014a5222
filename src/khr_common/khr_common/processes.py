"""Processes: one ends when its parent dies, however the parent dies, and one goes first."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from threading import Thread

PARENT = 'KHR_PARENT'  # environment variable: the process that a child must not outlive
_PR_SET_PDEATHSIG = 1  # prctl(2)


def tied_to_parent() -> Callable[[], None]:
    """Return a function for a child to call between fork and exec; it dies with this process.

    The kernel kills the child from then on, whatever program it becomes, and also if a signal
    stops that program as it starts.
    """
    parent, prctl = os.getpid(), ctypes.CDLL(None).prctl

    def tie() -> None:
        prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it has died before
            os.kill(os.getpid(), signal.SIGKILL)

    return tie


def end_with(parent: int) -> None:
    """Have the kernel kill this process when the thread of its parent that started it ends.

    Args:
        parent: process number; if the parent has ended already, this process is killed at once.
    """
    _ask(signal.SIGKILL)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)


def end_with_parent() -> None:
    """Have the kernel kill this process when its parent dies; nothing if no parent is named.

    The parent states its number in the environment, so that one which died before this call is
    noticed as well. The request survives an exec, and SIGKILL ends a stopped process too.
    """
    if PARENT in os.environ:
        end_with(int(os.environ[PARENT]))


def report_parents_end(orphaned: Callable[[], object], last: float = 30.0) -> None:
    """Have a function called when the parent dies, in the place of ``end_with_parent``.

    For a process that has to close its files. It uses SIGCONT, because it also wakes a stopped
    process. Anyone may send SIGCONT, so the parent is checked before the call.

    Args:
        orphaned: is called in the main thread.
        last: s of wall time from the parent's end until this process is killed if it is still
            there: a main thread that hangs outside of Python calls nothing.
    """
    if PARENT not in os.environ:
        return
    Thread(target=_end_late, args=(last,), daemon=True).start()

    def look(*_: object) -> None:
        if _orphaned():
            orphaned()

    signal.signal(signal.SIGCONT, look)
    _ask(signal.SIGCONT)
    look()


def _end_late(last: float) -> None:
    """Kill this process some time after its parent has ended."""
    with suppress(ProcessLookupError):  # it has ended already
        parent = os.pidfd_open(int(os.environ[PARENT]))
        select.select([parent], [], [])
        os.close(parent)
    time.sleep(last)
    os.kill(os.getpid(), signal.SIGKILL)


def _ask(number: int) -> None:
    """Ask the kernel for a signal at the parent's death."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)


def _orphaned() -> bool:
    return str(os.getppid()) != os.environ[PARENT]


def ask_for_real_time(priority: int) -> bool:
    """Let the calling thread run before all others as soon as it has something to do.

    It requests SCHED_FIFO for itself, not for its child processes; ``ulimit -r`` bounds the
    priority.

    Args:
        priority: 1 to 99; 0 asks for nothing.

    Returns:
        Whether it is granted.
    """
    if not priority:
        return False
    try:
        policy = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(priority))
    except OSError:
        return False
    return True
