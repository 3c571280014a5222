"""What the robot stands on: the soles of the thesis, and the pads of its force sensors.

Another one is a line here and a field ``friction_NAME`` of the simulator's parameters. Where the
feet touch the ground, :func:`khr_sim.physics.contact.corners` says.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from khr_common import parameter


@dataclass(frozen=True)
class Surface:
    """A pair of materials: their coefficient of friction by default, and what they are."""

    friction: float
    meaning: str


SURFACES = {
    'smooth': Surface(0.2402, 'the bare sole on the smooth board'),
    'rubber': Surface(0.8, 'the rubber sole on the board'),
    'pads': Surface(0.8, 'the force-sensor pads on the board'),
}


def friction_of(surface: str) -> Any:
    """Declare the parameter of a surface's friction."""
    own = SURFACES[surface]
    return parameter(
        own.friction, f'Friction coefficient of {own.meaning}.', minimum=0.0, maximum=2.0
    )
