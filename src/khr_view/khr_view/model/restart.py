"""When a finished run restarts by itself."""

from __future__ import annotations

from typing import Literal, get_args

EndAction = Literal[
    'same', 'next', 'never'
]  # restart with the same seed, with the next one, or not
END_ACTIONS: tuple[EndAction, ...] = get_args(EndAction)
PAUSE = 2.0  # s of wall time for which the end of a run is shown


class RestartTimer:
    """Tell when a finished run is due to restart: once, after a pause."""

    def __init__(self) -> None:
        self._since: float | None = None  # wall time of the end, s

    def due(self, over: bool, now: float) -> bool:
        """Return whether the run restarts now.

        Args:
            over: whether the run is.
            now: wall time, s.
        """
        if not over:
            self._since = None
        elif self._since is None:
            self._since = now
        return self._since is not None and now - self._since >= PAUSE
