"""The motion of the gait: its length, and the length of a cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from typing import Any

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.derived import motion_end, swings
from khr_common import build
from khr_common.errors import KhrError


@dataclass(frozen=True)
class GaitMotion:
    """A motion from time 0 on."""

    doing: str = ''  # activity of the robot, such as walking; empty if it is unknown
    end: float = inf  # of the motion with its pauses, s; inf if it has none
    cycle: float = 0.0  # of a walk, s; 0 if it does not walk
    # start and end of each time that a foot is in the air, s, by left, right
    swings: Mapping[str, Sequence[tuple[float, float]]] = field(default_factory=dict)


STANDING = GaitMotion('standing')


def motion_of(parameters: GaitParameters) -> GaitMotion:
    """Return the motion of a gait; one that cannot be planned counts as standing."""
    if parameters.motion == 'stand':
        return STANDING
    try:
        end = motion_end(parameters)
    except KhrError:
        return STANDING
    if parameters.motion == 'walk':
        return GaitMotion('walking', end, parameters.cycle_period, swings(parameters))
    if parameters.motion == 'file':
        cycle = parameters.cycle_period if parameters.cyclic else 0.0
        return GaitMotion(f'moving by {parameters.label}', end, cycle, swings(parameters))
    return GaitMotion('lifting a leg', end, swings=swings(parameters))


def motion_in(values: Mapping[str, Any]) -> GaitMotion:
    """Return the motion of a gait of which some parameters are known, by name."""
    if 'motion' not in values:
        return GaitMotion()
    return motion_of(build(GaitParameters, values))
