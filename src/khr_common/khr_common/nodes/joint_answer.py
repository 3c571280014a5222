"""The answer of a node: joint positions that react to one sample."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

from khr_common import cdr
from khr_common.run_identity import MalformedError


class JointAnswer(NamedTuple):
    """Joint positions that a node asks for, rad, with the stamp of the sample that it answers."""

    stamp_ns: int
    name: tuple[str, ...]
    position: tuple[float, ...]


def read_answer(data: bytes) -> JointAnswer:
    """Read an answer from the bytes of its message.

    Raises:
        MalformedError: if it does not hold one finite position per joint.
    """
    names, positions = cdr.joint_positions(data)
    if len(names) != len(positions) or not isfinite(sum(positions)):
        raise MalformedError('not one finite position per joint')
    return JointAnswer(cdr.clock(data), names, positions)
