"""Whether a run that is over begins again by itself, and when."""

from __future__ import annotations

from typing import Literal, get_args

How = Literal['same', 'next', 'never']
HOW: tuple[How, ...] = get_args(How)
PAUSE = 2.0  # s of wall time in which the reader sees how it ended


class Again:
    """Say when a run that is over is to begin again: once, until it has begun.

    Args:
        how: with the same seed or the next one, or not at all.
    """

    def __init__(self, how: How) -> None:
        self.how = how
        self._since: float | None = None  # when it was over, s
        self._asked = False

    def due(self, over: bool, now: float) -> bool:
        """Return whether to begin now.

        Args:
            over: whether the run is.
            now: wall time, s.
        """
        if not over:
            self._since, self._asked = None, False
            return False
        if self._since is None:
            self._since = now
        if self.how == 'never' or self._asked or now - self._since < PAUSE:
            return False
        self._asked = True
        return True
