"""The errors of this package."""

from khr_common import KhrError


class BringupError(KhrError):
    """A scenario, a run or a command that cannot be carried out as asked."""


class RunError(BringupError):
    """A run that began and could not go on: a node died, or did not answer."""
