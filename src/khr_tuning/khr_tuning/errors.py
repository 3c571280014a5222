"""The error of this package."""

from khr_common import KhrError


class TuningError(KhrError):
    """A question about gains that cannot be answered as asked."""
