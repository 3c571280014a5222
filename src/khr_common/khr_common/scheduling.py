"""Which of the processes of a machine goes first."""

from __future__ import annotations

import os


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
