"""The 17 joints of the KHR-3HV and their order in every vector.

Pitch axes are +y and roll axes +x on both sides; in the zero pose the legs are straight, the
soles flat and the arms down.
"""

from __future__ import annotations

from khr_common.interfaces import ARM, JOINTS, LEG, SIDES

__all__ = ['ARM', 'INDEX', 'JOINTS', 'LEG', 'SIDES', 'other_side']

INDEX = {name: index for index, name in enumerate(JOINTS)}


def other_side(side: str) -> str:
    """Return 'l' for 'r', and 'r' for 'l'."""
    return 'r' if side == 'l' else 'l'
