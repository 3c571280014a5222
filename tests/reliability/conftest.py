"""Fixtures of real runs."""

from tests.graph.conftest import in_background

__all__ = ['in_background']
