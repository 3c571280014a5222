"""Checks of arguments: each refusal names argument, value and accepted range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from khr_common.errors import KhrError


def between(name: str, value: float, low: float, high: float, unit: str = '') -> None:
    """Refuse a value that is not finite and strictly between two bounds.

    Raises:
        KhrError: with the name, the value and the accepted range, in one line.
    """
    if not (math.isfinite(value) and low < value < high):
        raise KhrError(
            f'{name}: {value!r} is not accepted; accepted: ({low:g}, {high:g}) {unit}'.rstrip()
        )


def positive(name: str, value: float, unit: str = '') -> None:
    """Refuse a value that is not finite and above 0."""
    between(name, value, 0.0, math.inf, unit)


def non_negative(name: str, value: float) -> None:
    """Refuse a value that is not finite and at least 0."""
    if not (math.isfinite(value) and value >= 0.0):
        raise KhrError.refused(name, value, '[0, inf)')


def within(name: str, value: npt.ArrayLike, low: float, high: float) -> None:
    """Refuse a value, or an array with an element, outside [low, high] or not a number."""
    values = np.asarray(value, dtype=np.float64)
    outside = values[~((values >= low) & (values <= high))]
    if outside.size:
        raise KhrError.refused(name, float(outside.flat[0]), f'[{low:.6g}, {high:.6g}]')


def finite(name: str, value: float) -> None:
    """Refuse infinity and NaN."""
    if not math.isfinite(value):
        raise KhrError.refused(name, value, '(-inf, inf)')


def one_of(name: str, value: Any, choices: Sequence[str]) -> None:
    """Refuse a value that is not one of the choices."""
    if value not in choices:
        raise KhrError.refused(name, value, ' | '.join(choices))


def integer(name: str, value: Any, low: int, high: int) -> None:
    """Refuse all but an integer, of Python or NumPy, in [low, high]."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not (whole and low <= value <= high):
        raise KhrError.refused(name, value, f'integer in [{low}, {high}]')
