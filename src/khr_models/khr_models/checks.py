"""Checks of the models' arguments: each refusal names argument, value and accepted range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from khr_models.errors import ModelError

Array = npt.NDArray[np.float64]
Form = Literal['published', 'physical']
FORMS: tuple[Form, ...] = ('published', 'physical')
RIGHT_ANGLE = math.pi / 2.0


def between(name: str, value: float, low: float, high: float, unit: str = '') -> None:
    """Refuse a value that is not finite and strictly between two bounds.

    Raises:
        ModelError: with the name, the value and the accepted range, in one line.
    """
    if not (math.isfinite(value) and low < value < high):
        raise ModelError(
            f'{name}: {value!r} is not accepted; accepted: ({low:g}, {high:g}) {unit}'.rstrip()
        )


def positive(name: str, value: float, unit: str = '') -> None:
    """Refuse a value that is not finite and above 0."""
    between(name, value, 0.0, math.inf, unit)


def non_negative(name: str, value: float) -> None:
    """Refuse a value that is not finite and at least 0."""
    if not (math.isfinite(value) and value >= 0.0):
        raise ModelError(f'{name}: {value!r} is not accepted; accepted: [0, inf)')


def within(name: str, value: npt.ArrayLike, low: float, high: float) -> None:
    """Refuse a value, or an array with an element, outside [low, high] or not a number."""
    values = np.asarray(value, dtype=np.float64)
    outside = values[~((values >= low) & (values <= high))]
    if outside.size:
        raise ModelError(
            f'{name}: {float(outside.flat[0])!r} is not accepted; '
            f'accepted: [{low:.6g}, {high:.6g}]'
        )


def inclination_within(inclination: npt.ArrayLike) -> None:
    """Refuse an inclination past a vertical wall (rad)."""
    within('inclination', inclination, -RIGHT_ANGLE, RIGHT_ANGLE)


def finite(name: str, value: float) -> None:
    """Refuse infinity and NaN."""
    if not math.isfinite(value):
        raise ModelError(f'{name}: {value!r} is not accepted; accepted: (-inf, inf)')


def one_of(name: str, value: Any, choices: Sequence[str]) -> None:
    """Refuse a value that is not one of the choices."""
    if value not in choices:
        raise ModelError(f'{name}: {value!r} is not accepted; accepted: {" | ".join(choices)}')


def sign_of(form: Form) -> float:
    """Return the sign of gravity's moment in a form: +1 physical, -1 as published.

    Raises:
        ModelError: if the form is unknown.
    """
    one_of('form', form, FORMS)
    return 1.0 if form == 'physical' else -1.0


def time_grid(duration: float, step: float) -> Array:
    """Return the times 0, step, ... up to duration (s).

    Raises:
        ModelError: if either is not positive, or step is above duration.
    """
    positive('duration', duration)
    positive('step', step)
    if step > duration:
        raise ModelError(f'step: {step!r} is not accepted; accepted: (0, {duration:g}]')
    count = math.floor(duration / step * (1.0 + 1e-12)) + 1
    return step * np.arange(count, dtype=np.float64)
