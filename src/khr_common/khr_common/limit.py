"""Search the limit up to which something holds: by growing steps, then by bisection."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, isfinite
from typing import NamedTuple


class Bracket(NamedTuple):
    """The largest value that held and the smallest that did not; twice the end at an end."""

    held: float
    lost: float

    @property
    def middle(self) -> float:
        """Return the limit between them."""
        return (self.held + self.lost) / 2.0


def bracket_limit(
    holds: Callable[[float], bool],
    start: float,
    ends: tuple[float, float],
    step: float,
    tolerance: float,
    growth: float = 1.0,
) -> Bracket:
    """Bracket the limit up to which something holds.

    If the property is not monotonic, one of its crossings is found. The limit is clamped to the
    interval: at its lower end if the property does not hold there, at its upper end if it does.

    Args:
        holds: asked once for each value.
        start: first value, within the ends.
        ends: of the range; the upper one may be infinite.
        step: first one away from the start, taken until both answers have been seen.
        tolerance: largest width of the bracket.
        growth: of the step with each value.
    """
    held, lost, here = -inf, inf, start
    while lost - held > tolerance + 1e-9:
        if holds(here):
            held, onward = here, min(here + step, ends[1])
        else:
            lost, onward = here, max(here - step, ends[0])
        if held >= ends[1] or lost <= ends[0]:
            return Bracket(here, here)
        here = (held + lost) / 2.0 if isfinite(lost - held) else onward
        step *= growth
    return Bracket(held, lost)
