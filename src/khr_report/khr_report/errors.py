"""The error of this package."""

from khr_common import KhrError


class ReportError(KhrError):
    """A figure, page or film that cannot be made as asked."""
