"""The state of a run as text: the motion, how the run ended, and the action that follows."""

from __future__ import annotations

from khr_view.model.motion import GaitMotion
from khr_view.model.status import Status

NO_RUN = 'no run'
THEN = {'same': 'restarts', 'next': 'restarts, next seed', 'never': 'press Restart'}
OTHERWISE = {'waiting': 'starting', NO_RUN: 'no run is going on: the page waits for one'}


def fell_at(status: Status, time: float) -> float | None:
    """Return when the robot fell, s; None if it has not fallen by this time."""
    fell = status.outcome.fell_at if status.outcome else None
    return fell if fell is not None and fell <= time else None


def over(status: Status, motion: GaitMotion, time: float) -> bool:
    """Return whether the robot fell or its motion has ended."""
    if status.state == 'finished':
        return True
    done = time >= motion.end or fell_at(status, time) is not None
    return status.state == 'running' and done


def state_text(status: Status, motion: GaitMotion, time: float, at_the_end: str | None) -> str:
    """Describe the state of a run at a simulated time.

    Args:
        status: that the graph reports.
        motion: of the gait.
        time: simulated, s.
        at_the_end: the action that follows the end, a key of THEN; None if there is no next run.
    """
    then = f': {THEN[at_the_end]}' if at_the_end else ''
    if status.state in OTHERWISE:
        return OTHERWISE[status.state]
    if status.state == 'paused':
        return f'paused at {time:.1f} s'
    fell = fell_at(status, time)
    if fell is not None:
        return f'fell at {fell:.1f} s{then}'
    if over(status, motion, time):
        return f'finished, {status.verdict or "not judged"}{then}'
    if status.state != 'running':
        return status.state
    of = f' of {motion.end:.1f}' if motion.end < float('inf') else ''
    return f'{motion.doing or "running"}, {time:.1f}{of} s'
