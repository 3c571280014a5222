"""The pendulum on a foot that may slide: the friction that Dutta (2021), ch. 6, leaves open.

The foot of mass m_f lies flat on the incline and moves along it by s (positive downhill for
phi > 0); the point mass m stands on it, held by the ankle servo's torque. In surface axes,
    m l^2 th'' + m l cos(th) s''                          = m g l sin(th + phi) + torque
    (m + m_f) s'' + m l (cos(th) th'' - sin(th) th'^2)    = (m + m_f) g sin(phi) - T
    N = (m + m_f) g cos(phi) - m l (sin(th) th'' + cos(th) th'^2)
with Coulomb's cone |T| <= mu N: the foot sticks inside it and slides, T = mu N sign(s'), on it.
The first line is (3.11), physical, plus the one term the thesis's model lacks, -m l cos(th) s''.
At rest T/N = tan(phi): the foot slides from phi = atan(mu), whatever the gains.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from khr_common.checks import non_negative, positive, within
from khr_common.errors import KhrError
from khr_models.checks import RIGHT_ANGLE, Array, inclination_within, time_grid
from khr_models.pendulum import GRAVITY, Pendulum
from khr_models.standing.ankle_servo import Pid, ServoMotion

MODE_CHANGES = 1000  # more than this in one run is chatter, not physics
CONE_TOLERANCE = 1e-6  # share by which a sticking foot may pass its cone: rounding, not a slide


@dataclass(frozen=True)
class SlidingFoot:
    """The foot's constants.

    Raises:
        KhrError: if the mass is not positive or the friction negative.
    """

    friction: float = 0.18  # mu; static and sliding alike; slips near 10 deg
    mass: float = 0.111  # kg, ankle block and foot of one leg

    def __post_init__(self) -> None:
        non_negative('friction', self.friction)
        positive('mass', self.mass)


@dataclass(frozen=True)
class SlidingMotion(ServoMotion):
    """A servo's motion on a sliding foot.

    ``slide`` (m) and ``slide_rate`` (m/s) are the foot's, ``friction_force`` T is positive
    uphill (for phi > 0), ``normal_force`` N is the ground's, both N. The foot tips rather than
    slides where |force_difference| exceeds normal_force.
    """

    slide: Array
    slide_rate: Array
    friction_force: Array
    normal_force: Array


def sliding_inclination(friction: float) -> float:
    """Return the inclination at which a body at rest starts to slide, atan(mu), rad."""
    non_negative('friction', friction)
    return math.atan(friction)


class _Dynamics:
    """The equations above, for the foot sticking (direction 0) or sliding (+1, -1)."""

    def __init__(
        self, pendulum: Pendulum, foot: SlidingFoot, pid: Pid, target: float, inclination: float
    ) -> None:
        self._body, self._foot, self._pid, self._target = pendulum, foot, pid, target
        self._inclination = inclination
        self.frictionless = foot.friction == 0.0
        total = pendulum.mass + foot.mass
        self._total = total
        self._downhill = total * GRAVITY * math.sin(inclination)
        self._into = total * GRAVITY * math.cos(inclination)

    def carrying(self, lean: float) -> float:
        """Return the integral of the error with which the servo holds a lean at rest, rad s."""
        if self._pid.integral == 0.0:
            return 0.0
        weight = self._body.gravity_moment * math.sin(lean + self._inclination)
        return -(weight + self._pid.proportional * (self._target - lean)) / self._pid.integral

    def torque(self, state: Sequence[Any]) -> Any:
        """Return the servo's torque, N m, for a state (th, th', int e, s, s') or rows of them."""
        return self._pid.torque(self._target - state[0], state[2], -state[1])

    def accelerations(
        self, state: Sequence[float], direction: float
    ) -> tuple[float, float, float, float]:
        """Return th'', s'', T and N."""
        lean, rate = state[0], state[1]
        sine, cosine = math.sin(lean), math.cos(lean)
        couple, inertia = self._body.mass * self._body.length, self._body.inertia
        gravity = self._body.gravity_moment * math.sin(lean + self._inclination)
        moment = gravity + self.torque(state)
        spin = couple * rate**2
        if direction == 0.0:
            lean_acceleration, slide_acceleration = moment / inertia, 0.0
        else:
            cone = self._foot.friction * direction
            # T = cone N in the second line, N from the third, then th'' from the first
            lever = couple * (cosine - cone * sine)
            drive = self._downhill + spin * (sine + cone * cosine) - cone * self._into
            determinant = self._total - lever * couple * cosine / inertia
            if determinant <= 0.0:
                raise KhrError(
                    f'friction: {self._foot.friction!r} jams the sliding foot at a lean of '
                    f'{math.degrees(lean):.1f} deg; accepted: below '
                    f'{self._jam(sine, cosine):.3g} there, or a heavier foot'
                )
            slide_acceleration = (drive - lever * moment / inertia) / determinant
            lean_acceleration = (moment - couple * cosine * slide_acceleration) / inertia
        normal = self._into - couple * sine * lean_acceleration - spin * cosine
        tangent = (
            self._downhill
            - self._total * slide_acceleration
            - couple * cosine * lean_acceleration
            + spin * sine
        )
        return lean_acceleration, slide_acceleration, tangent, normal

    def _jam(self, sine: float, cosine: float) -> float:
        """Return the friction at which rigid-body sliding loses its solution (Painleve)."""
        ratio = self._foot.mass / self._body.mass
        return (ratio + sine**2) / abs(sine * cosine)

    def derivative(self, state: Sequence[float], direction: float) -> tuple[float, ...]:
        """Return the state's rate of change."""
        lean_acceleration, slide_acceleration, _, _ = self.accelerations(state, direction)
        return (state[1], lean_acceleration, self._target - state[0], state[4], slide_acceleration)

    def cone_margin(self, state: Sequence[float]) -> float:
        """Return mu N - |T| of the sticking foot, N: it sticks while this is positive."""
        _, _, tangent, normal = self.accelerations(state, 0.0)
        return self._foot.friction * (1.0 + CONE_TOLERANCE) * normal - abs(tangent)

    def direction_from_rest(self, state: Sequence[float]) -> float:
        """Return 0 if a foot at rest sticks, else the direction in which it starts to slide."""
        sticks = self.cone_margin(state) >= 0.0 and not self.frictionless
        return 0.0 if sticks else self.direction_of_slide(state)

    def direction_of_slide(self, state: Sequence[float]) -> float:
        """Return the direction, +-1, in which a foot at rest is drawn."""
        return math.copysign(1.0, self.accelerations(state, 0.0)[2])


def simulate_sliding(
    pendulum: Pendulum,
    foot: SlidingFoot,
    pid: Pid,
    *,
    target: float = 0.0,
    inclination: float = 0.0,
    initial_lean: float = 0.0,
    duration: float = 5.0,
    step: float = 5e-3,
) -> SlidingMotion:
    """Integrate the sliding pendulum from rest, its servo already carrying its weight.

    Returns:
        The motion, ended early if the body comes to lie on the surface or the foot leaves it.

    Raises:
        KhrError: if an argument is out of range, or the friction is so large at the lean
            reached that rigid-body sliding has no solution (the message says from where).
    """
    inclination_within(inclination)
    within('target', target, -RIGHT_ANGLE, RIGHT_ANGLE)
    within('initial_lean', initial_lean, -RIGHT_ANGLE, RIGHT_ANGLE)
    times = time_grid(duration, step)
    dynamics = _Dynamics(pendulum, foot, pid, target, inclination)
    state = [initial_lean, 0.0, dynamics.carrying(initial_lean), 0.0, 0.0]
    direction = dynamics.direction_from_rest(state)
    pieces: list[tuple[Array, Array, float]] = []
    pending, start = times, 0.0
    for _ in range(MODE_CHANGES):
        run = _phase(dynamics, state, direction, start, pending)
        if len(run.t):
            pieces.append((run.t, run.y, direction))
            pending = pending[len(run.t) :]
        if not pending.size or run.t_events[1].size:
            return _assemble(pendulum, dynamics, pieces)
        start, state = float(run.t_events[0][0]), run.y_events[0][0].tolist()
        state[4] = 0.0
        judge = dynamics.direction_from_rest if direction else dynamics.direction_of_slide
        direction = judge(state)
    raise KhrError(
        f'pid: {pid!r} makes the foot chatter; accepted: gains that change '
        f'between sticking and sliding fewer than {MODE_CHANGES} times'
    )


def _phase(
    dynamics: _Dynamics, state: Sequence[float], direction: float, start: float, pending: Array
) -> Any:
    """Integrate until the foot stops or starts to slide (event 0), or the run ends (event 1)."""

    def changes(_time: float, state: Array) -> float:
        if dynamics.frictionless:
            return 1.0
        return direction * float(state[4]) if direction else dynamics.cone_margin(state.tolist())

    def ends(_time: float, state: Array) -> float:
        values: list[float] = state.tolist()
        return min(dynamics.accelerations(values, direction)[3], RIGHT_ANGLE - abs(values[0]))

    changes.terminal = ends.terminal = True  # type: ignore[attr-defined]
    changes.direction = ends.direction = -1.0  # type: ignore[attr-defined]
    return solve_ivp(
        lambda _time, state: dynamics.derivative(state.tolist(), direction),
        (start, float(pending[-1])),
        np.array(state),
        t_eval=pending,
        events=(changes, ends),
        method='LSODA',
        rtol=1e-9,
        atol=1e-11,
    )


def _assemble(
    pendulum: Pendulum, dynamics: _Dynamics, pieces: list[tuple[Array, Array, float]]
) -> SlidingMotion:
    times = np.concatenate([time for time, _, _ in pieces])
    states = np.concatenate([states for _, states, _ in pieces], axis=1)
    tangent, normal = np.array(
        [
            dynamics.accelerations(state, direction)[2:]
            for _, states, direction in pieces
            for state in states.T.tolist()
        ]
    ).T
    lean, rate, _, slide, slide_rate = states
    torque = np.asarray(dynamics.torque(list(states)))
    delta = -torque / pendulum.half_foot
    return SlidingMotion(times, lean, rate, torque, delta, slide, slide_rate, tangent, normal)
