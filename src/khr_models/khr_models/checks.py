"""The two forms of the thesis's equations, checks of their arguments, and their integration."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.integrate import ODEintWarning, odeint

from khr_common.checks import one_of, positive, within
from khr_common.errors import KhrError

Array = npt.NDArray[np.float64]
Form = Literal['published', 'physical']
FORMS: tuple[Form, ...] = ('published', 'physical')
RIGHT_ANGLE = math.pi / 2.0
Derivative = Callable[[float, Array], Sequence[float]]
TOLERANCE = 1e-12


def inclination_within(inclination: npt.ArrayLike) -> None:
    """Refuse an inclination past a vertical wall (rad)."""
    within('inclination', inclination, -RIGHT_ANGLE, RIGHT_ANGLE)


def sign_of(form: Form) -> float:
    """Return the sign of gravity's moment: +1 in the physical form, -1 in the published one.

    Raises:
        KhrError: if there is no such form.
    """
    one_of('form', form, FORMS)
    return 1.0 if form == 'physical' else -1.0


def time_grid(duration: float, step: float) -> Array:
    """Return the times 0, step, ... up to duration (s).

    Raises:
        KhrError: if either is not positive, or step is above duration.
    """
    positive('duration', duration)
    positive('step', step)
    if step > duration:
        raise KhrError.refused('step', step, f'(0, {duration:g}]')
    count = math.floor(duration / step * (1.0 + 1e-12)) + 1
    return step * np.arange(count, dtype=np.float64)


def integrate(derivative: Derivative, initial: Sequence[float], times: Array) -> Array:
    """Integrate by LSODA; return the states at the times, (states, times), from those at times[0].

    Args:
        derivative: of (time, state), smooth enough to be integrated.

    Raises:
        KhrError: if the integrator cannot keep its tolerance of 1e-12.
    """
    with warnings.catch_warnings():
        warnings.simplefilter('error', ODEintWarning)
        try:
            accuracy = {'rtol': TOLERANCE, 'atol': TOLERANCE, 'mxstep': 20_000}
            states = odeint(derivative, initial, times, tfirst=True, **accuracy)
        except ODEintWarning as failure:
            raise _refusal(initial, str(failure).split('.')[0]) from failure
    states = np.asarray(states, dtype=np.float64).T
    if not np.isfinite(states).all():
        raise _refusal(initial, 'it leaves the finite numbers')
    return states


def _refusal(initial: Sequence[float], why: str) -> KhrError:
    return KhrError(
        f'derivative: the motion from {tuple(initial)} cannot be integrated '
        f'({why}); accepted: bounded, continuous derivatives'
    )
