"""Rotations in the convention of viser."""

from __future__ import annotations

from collections.abc import Iterable


def wxyz(turn: Iterable[float]) -> tuple[float, float, float, float]:
    """Convert a quaternion from (x, y, z, w) to viser's (w, x, y, z)."""
    x, y, z, w = turn
    return w, x, y, z
