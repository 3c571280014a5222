"""The errors of khr_balance."""

from khr_common import KhrError


class BalanceError(KhrError):
    """A gait or controller was asked for something it cannot do."""


class UnreachableError(BalanceError):
    """A leg cannot put its sole where it was asked to.

    Attributes:
        index: the first element of the arrays asked for that is out of reach (0 for a scalar).
    """

    def __init__(self, reason: str, index: int) -> None:
        super().__init__(reason)
        self.index = index
