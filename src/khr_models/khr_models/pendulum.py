"""The footed inverted pendulum on an incline: Dutta (2021), equations (3.1) to (3.10).

A point mass on a massless leg stands on a massless foot of length 2 b, its ankle over the foot's
middle. Angles in rad, forward lean and downhill-facing inclination positive; ``force_difference``
is Delta = F_T - F_H in N, positive when the toe carries more, so its moment Delta b pushes the
body back.

Printed, (3.1), (3.5) and (3.6) have the signs of a hanging pendulum,
    J th'' = -m g l sin(th + phi) + Delta b          (published)
and an inverted one has both the other way round,
    J th'' = +m g l sin(th + phi) - Delta b          (physical).
Their statics, and so (3.7) to (3.10), agree; their dynamics are opposite.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeVar, cast

import numpy as np
from scipy.constants import g

from khr_common.checks import finite, one_of, positive, within
from khr_models.checks import (
    RIGHT_ANGLE,
    Array,
    Form,
    inclination_within,
    integrate,
    sign_of,
    time_grid,
)

Value = TypeVar('Value', float, Array)
CriticalForm = Literal['published', 'exact', 'tangent']
CRITICAL_FORMS: tuple[CriticalForm, ...] = ('published', 'exact', 'tangent')
GRAVITY = float(g)  # m/s^2, standard


def _plain(value: Any, like: Value) -> Value:
    """Turn NumPy's scalars into floats, and type the value as the argument it came from."""
    return cast(Value, float(value) if np.ndim(value) == 0 else value)


@dataclass(frozen=True)
class Pendulum:
    """The pendulum's constants.

    The defaults are the thesis's: 1.5 kg; l = 0.307 m from f_n = 0.9 Hz (5.8); b = 0.1 l from
    phi_cr,theo = 5.7 deg (3.10).

    Raises:
        KhrError: if one is not positive, or half_foot is above length.
    """

    mass: float = 1.5  # kg
    length: float = 0.307  # m, ankle to centre of mass, l
    half_foot: float = 0.0307  # m, ankle to toe and ankle to heel, b

    def __post_init__(self) -> None:
        positive('mass', self.mass)
        positive('length', self.length)
        positive('half_foot', self.half_foot)
        within('half_foot', self.half_foot, 0.0, self.length)

    @property
    def inertia(self) -> float:
        """J_A = m l^2 about the ankle, kg m^2."""
        return self.mass * self.length**2

    @property
    def edge_inertia(self) -> float:
        """Return m (l^2 + b^2) about toe or heel, kg m^2."""
        return self.mass * (self.length**2 + self.half_foot**2)

    @property
    def weight(self) -> float:
        """Return m g, N."""
        return self.mass * GRAVITY

    @property
    def gravity_moment(self) -> float:
        """Return m g l, N m."""
        return self.weight * self.length

    @property
    def natural_frequency(self) -> float:
        """f_n of (5.8), Hz."""
        return math.sqrt(GRAVITY / self.length) / (2.0 * math.pi)


@dataclass(frozen=True)
class PendulumMotion:
    """A simulated motion: time (s), lean (rad) and its rate (rad/s), arrays of one length."""

    time: Array
    lean: Array
    rate: Array


def foot_forces(normal_force: Value, to_toe: Value, half_foot: float) -> tuple[Value, Value]:
    """Return the forces on toe and heel, F_T and F_H of (3.2) and (3.3), N.

    Args:
        normal_force: of the ground on the foot, N.
        to_toe: distance of the ZMP behind the toe, m.
        half_foot: half the length of the foot, m.

    Raises:
        KhrError: if half_foot is not positive, the normal force is negative, as if the ground
            pulled, or the ZMP is outside the foot.
    """
    positive('half_foot', half_foot)
    within('normal_force', normal_force, 0.0, math.inf)
    within('to_toe', to_toe, 0.0, 2.0 * half_foot)
    heel = normal_force * to_toe / (2.0 * half_foot)  # (3.2)
    return normal_force * (2.0 * half_foot - to_toe) / (2.0 * half_foot), heel  # (3.3)


def force_difference(normal_force: Value, to_toe: Value, half_foot: float) -> Value:
    """Return Delta = F_T - F_H, N, for a ZMP at distance d from the toe (3.4)."""
    positive('half_foot', half_foot)
    within('to_toe', to_toe, 0.0, 2.0 * half_foot)
    return normal_force * (half_foot - to_toe) / half_foot


def lean_acceleration(
    pendulum: Pendulum,
    lean: Value,
    difference: Value | float = 0.0,
    *,
    inclination: float = 0.0,
    form: Form = 'physical',
) -> Value:
    """Return th'' in rad/s^2: (3.5), with an inclination (3.6).

    By (3.4) it is (3.1) too: Delta b = N (b - d).

    Raises:
        KhrError: if the inclination is past 90 deg or the form is unknown.
    """
    inclination_within(inclination)
    sign = sign_of(form)
    moment = pendulum.gravity_moment * np.sin(lean + inclination) - difference * pendulum.half_foot
    return _plain(sign * moment / pendulum.inertia, lean)


def static_force_difference(pendulum: Pendulum, lean: Value, inclination: Value) -> Value:
    """Return the Delta that balances gravity at rest, N (3.7), the same in both forms.

    The foot stands only while it stays within +- the normal force: see
    :func:`critical_inclination`.
    """
    inclination_within(inclination)
    return _plain(pendulum.gravity_moment * np.sin(lean + inclination) / pendulum.half_foot, lean)


def critical_inclination(
    pendulum: Pendulum, initial_lean: Value, form: CriticalForm = 'published'
) -> Value:
    """Return the inclination at which the heel force reaches 0, rad.

    - 'published': asin((b - l sin th)/(l cos th)), (3.10); at zero lean asin(b/l), (3.9);
    - 'exact': asin(b/l) - th, which is (3.10) without its cos(phi) = 1;
    - 'tangent': atan((b - l sin th)/(l cos th)), at zero lean the tan form atan(b/l). This one is
      physical: gravity's line passes through the toe. (3.9) lets Delta reach m g, but on an
      incline the normal force, hence Delta, ends at m g cos(phi).

    Raises:
        KhrError: if the form is unknown, or a lean has no critical inclination within
            +-90 deg.
    """
    one_of('form', form, CRITICAL_FORMS)
    ratio = pendulum.half_foot / pendulum.length
    if form == 'exact':
        middle, reach = math.asin(ratio), RIGHT_ANGLE
    elif form == 'tangent':
        middle, reach = 0.0, RIGHT_ANGLE - 1e-9
    else:  # |b - l sin th| = l cos th
        middle, reach = math.asin(ratio / math.sqrt(2.0)), RIGHT_ANGLE / 2.0
    within('initial_lean', initial_lean, middle - reach, middle + reach)
    if form == 'exact':
        return _plain(middle - initial_lean, initial_lean)
    argument = (ratio - np.sin(initial_lean)) / np.cos(initial_lean)
    if form == 'tangent':
        return _plain(np.arctan(argument), initial_lean)
    return _plain(np.arcsin(np.clip(argument, -1.0, 1.0)), initial_lean)


def simulate(
    pendulum: Pendulum,
    *,
    inclination: float = 0.0,
    initial_lean: float = 0.0,
    initial_rate: float = 0.0,
    difference: Callable[[float, float, float], float] | float = 0.0,
    duration: float = 5.0,
    step: float = 1e-3,
    form: Form = 'physical',
) -> PendulumMotion:
    """Integrate (3.6) from an initial lean and rate.

    Args:
        difference: Delta in N, constant or as a function of (time, lean, rate).
        duration: s.
        step: spacing of the returned samples, s; the integrator chooses its own.

    Returns:
        The motion, ended early if the body comes to lie on the surface (lean of +-90 deg).

    Raises:
        KhrError: as :func:`lean_acceleration`; if an initial value, the duration or the
            step is out of range.
    """
    inclination_within(inclination)
    sign = sign_of(form)
    within('initial_lean', initial_lean, -RIGHT_ANGLE, RIGHT_ANGLE)
    finite('initial_rate', initial_rate)
    if not callable(difference):
        finite('difference', difference)
    times = time_grid(duration, step)
    gravity = sign * pendulum.gravity_moment / pendulum.inertia
    lever = sign * pendulum.half_foot / pendulum.inertia
    delta = difference if callable(difference) else (lambda _t, _lean, _rate: difference)

    def derivative(time: float, state: Array) -> tuple[float, float]:  # (3.6)
        lean, rate = float(state[0]), float(state[1])
        return rate, gravity * math.sin(lean + inclination) - lever * delta(time, lean, rate)

    return until_lying(times, integrate(derivative, (initial_lean, initial_rate), times))


def until_lying(times: Array, states: Array) -> PendulumMotion:
    """Cut a motion, its lean and rate in rows 0 and 1, where the body comes to lie down."""
    lying = np.abs(states[0]) > RIGHT_ANGLE
    end = int(np.argmax(lying)) if lying.any() else times.size
    return PendulumMotion(times[:end], states[0, :end], states[1, :end])


def energy(
    pendulum: Pendulum,
    motion: PendulumMotion,
    *,
    inclination: float = 0.0,
    form: Form = 'physical',
) -> Array:
    """Return the energy along a motion, J, which (3.6) conserves where Delta = 0."""
    inclination_within(inclination)
    potential = sign_of(form) * pendulum.gravity_moment * np.cos(motion.lean + inclination)
    return np.asarray(0.5 * pendulum.inertia * motion.rate**2 + potential)
