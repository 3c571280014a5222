"""The error of this package."""

from khr_common import KhrError


class SweepError(KhrError):
    """A sweep that cannot be carried out as asked."""
