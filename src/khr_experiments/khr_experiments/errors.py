"""The error of this package."""

from khr_common import KhrError


class ExperimentError(KhrError):
    """An experiment that cannot be carried out as asked."""
