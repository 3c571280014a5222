"""The state of a run in words: what the robot does, how it ended, and what comes next."""

from __future__ import annotations

from khr_view.model.motion import GaitMotion
from khr_view.model.status import Status

NO_RUN = 'no run'
THEN = {
    'same': 'begins again',
    'next': 'begins again with the next seed',
    'never': 'Reset begins it again',
}
OTHERWISE = {
    'waiting': 'starting',
    'resetting': 'beginning again',
    NO_RUN: 'no run is going on: the page waits for one',
}


def fell_at(status: Status, time: float) -> float | None:
    """Return when the robot fell, s; None if it has not by this time.

    A report of the run before may still come when the next one has begun: its fall lies ahead.
    """
    fell = status.outcome.fell_at if status.outcome else None
    return fell if fell is not None and fell <= time else None


def over(status: Status, motion: GaitMotion, time: float) -> bool:
    """Return whether nothing more is to come: the robot fell, or its motion has ended."""
    if status.state == 'finished':
        return True
    done = time >= motion.end or fell_at(status, time) is not None
    return status.state == 'running' and done


def in_words(status: Status, motion: GaitMotion, time: float, again: str) -> str:
    """Return the state of a run at a simulated time.

    Args:
        status: that the graph reports.
        motion: of the gait.
        time: simulated, s.
        again: how a run that is over begins again, a key of THEN.
    """
    if status.state in OTHERWISE:
        return OTHERWISE[status.state]
    if status.state == 'paused':
        return f'paused at {time:.1f} s'
    fell = fell_at(status, time)
    if fell is not None:
        return f'fell at {fell:.1f} s: {THEN[again]}'
    if over(status, motion, time):
        return f'finished, {status.verdict or "not judged"}: {THEN[again]}'
    if status.state != 'running':
        return status.state
    of = f' of {motion.end:.1f}' if motion.end < float('inf') else ''
    return f'{motion.doing or "running"}, {time:.1f}{of} s'
