"""Errors of this package."""

from khr_common import KhrError


class ViewError(KhrError):
    """Something that the page cannot show or serve; the text is one line."""
