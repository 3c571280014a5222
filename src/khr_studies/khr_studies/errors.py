"""The error of this package."""

from khr_common import KhrError


class StudyError(KhrError):
    """An experiment that cannot be carried out as asked."""
