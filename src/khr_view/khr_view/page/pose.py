"""Rotations as viser has them."""

from __future__ import annotations

from collections.abc import Iterable


def wxyz(turn: Iterable[float]) -> tuple[float, float, float, float]:
    """Return a quaternion x y z w as viser has it."""
    x, y, z, w = turn
    return w, x, y, z
