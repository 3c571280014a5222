"""Corrections of the controllers, added to a reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from khr_common.interfaces import JOINTS


def add_corrections(
    reference: Sequence[float], corrections: Sequence[Mapping[str, float]]
) -> list[float]:
    """Add corrections by joint to a reference, in their order."""
    target = list(reference)
    for correction in corrections:
        for joint, angle in correction.items():
            target[JOINTS.index(joint)] += angle
    return target
