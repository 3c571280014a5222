"""The error of this package."""

from khr_common import KhrError


class FigureError(KhrError):
    """A figure that cannot be drawn."""
