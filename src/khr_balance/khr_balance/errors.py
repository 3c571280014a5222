"""Errors of the gait."""

from khr_common import KhrError


class GaitError(KhrError):
    """The robot cannot perform the motion of the parameters."""


class UnreachableError(GaitError):
    """A leg cannot reach the position of its sole.

    Attributes:
        index: of the first position out of reach in the arrays (0 for a scalar).
    """

    def __init__(self, reason: str, index: int) -> None:
        super().__init__(reason)
        self.index = index
