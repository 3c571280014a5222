"""The error that khr_analysis raises."""

from khr_common.errors import KhrError


class AnalysisError(KhrError):
    """An argument is outside the accepted range."""
