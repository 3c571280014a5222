"""The motion of the gait: its length, and the length of a cycle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Any

from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.derived import motion_end
from khr_common.errors import KhrError


@dataclass(frozen=True)
class GaitMotion:
    """A motion from time 0 on.

    Attributes:
        doing: activity of the robot, such as walking; empty if it is unknown.
        end: of the motion with its pauses, s; inf if it has none.
        cycle: of a walk, s; 0 if it does not walk.
    """

    doing: str = ''
    end: float = inf
    cycle: float = 0.0


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
        return GaitMotion('walking', end, parameters.cycle_period)
    return GaitMotion('lifting a leg', end)


def motion_in(values: Mapping[str, Any]) -> GaitMotion:
    """Return the motion of a gait of which some parameters are known, by name."""
    if 'motion' not in values:
        return GaitMotion()
    return motion_of(replace(GaitParameters(), **values))
