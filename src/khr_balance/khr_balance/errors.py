"""Errors of a gait that the robot cannot do."""

from khr_common import KhrError


class GaitError(KhrError):
    """The robot cannot move as the gait's parameters ask."""


class UnreachableError(GaitError):
    """A leg cannot put its sole where it was asked to.

    Attributes:
        index: the first element of the arrays asked for that is out of reach (0 for a scalar).
    """

    def __init__(self, reason: str, index: int) -> None:
        super().__init__(reason)
        self.index = index
