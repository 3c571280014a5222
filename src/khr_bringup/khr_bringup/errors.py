"""The error of this package."""

from khr_common import KhrError


class BringupError(KhrError):
    """A scenario or a run that cannot be carried out as asked."""
