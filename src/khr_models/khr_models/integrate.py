"""One way to integrate the models' equations: LSODA at a tolerance near machine accuracy."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import numpy as np
from scipy.integrate import ODEintWarning, odeint

from khr_common.errors import KhrError
from khr_models.checks import Array

Derivative = Callable[[float, Array], Sequence[float]]
TOLERANCE = 1e-12


def integrate(derivative: Derivative, initial: Sequence[float], times: Array) -> Array:
    """Return the states at the times, shape (states, times), from those at times[0].

    Args:
        derivative: of (time, state), smooth enough to be integrated.

    Raises:
        KhrError: if the integrator cannot keep its tolerance of 1e-12.
    """
    with warnings.catch_warnings():
        warnings.simplefilter('error', ODEintWarning)
        try:
            states = odeint(
                derivative,
                initial,
                times,
                tfirst=True,
                rtol=TOLERANCE,
                atol=TOLERANCE,
                mxstep=20_000,
            )
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
