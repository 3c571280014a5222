"""Refusals in the one form that every argument of this package shares."""

import math

from khr_sim.errors import SimError


def check_range(name: str, value: float, low: float, high: float, unit: str = '') -> None:
    """Accept a finite ``value`` strictly between ``low`` and ``high``.

    Raises:
        SimError: with the name, the value and the accepted range, in one line.
    """
    if not (math.isfinite(value) and low < value < high):
        raise SimError(
            f'{name}: {value!r} is not accepted; accepted: ({low:g}, {high:g}) {unit}'.rstrip()
        )


def check_positive(name: str, value: float, unit: str = '') -> None:
    """Accept a finite ``value`` above zero.

    Raises:
        SimError: with the name, the value and the accepted range, in one line.
    """
    check_range(name, value, 0.0, math.inf, unit)
