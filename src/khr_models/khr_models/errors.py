"""The error that khr_models raises."""

from khr_common.errors import KhrError


class ModelError(KhrError):
    """An argument is outside the accepted range of a model."""
