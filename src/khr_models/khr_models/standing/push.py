"""Recovery from a push with the ankle: Dutta (2021), (4.1) to (4.7), gyro and servo in the loop.

Published: the robot tips about its toe O as a pendulum of length L_0 = sqrt(l^2 + b^2) (4.1),
    m L^2 th'' = m g L sin(th) + F L cos(th),  (4.4), (4.5)
    L = sqrt(L_0^2 + 2 b l sin(th_A)),  (4.6)
from th = -th_0 = -atan(b/l) (4.2); its centre of mass is at x_COM = L sin(th) from O. The
equation knows no ground: here the foot's landing at -th_0 ends the backward motion (4.3).

Physical: the pendulum stands on its ankle, on ground that can only push,
    m l^2 q'' = m g l sin(q + phi) + F l cos(q + phi) + torque,  |torque| <= N b,
N the normal force: the ankle's torque ends where the toe or the heel carries everything (3.7).
With the torque on that limit this is tipping about the toe, but for the foot's own, small,
rotation. x_COM = l sin(q + phi) - b cos(phi), the horizontal distance from the toe.

In both the board samples the gyro's rate once a period, multiplies it by K_A, and the correction
moves the ankle's target a delay later: the lean asked for opposes the rate. A push from behind is
forward (F > 0). The published form treats one from the front as its mirror image about the heel.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from khr_common.checks import finite, one_of, positive, within
from khr_common.errors import KhrError
from khr_common.limit import bracket_limit
from khr_models.checks import FORMS, RIGHT_ANGLE, Array, Form, inclination_within
from khr_models.pendulum import GRAVITY, Pendulum
from khr_models.standing.ankle_servo import Pid

State = tuple[float, ...]
# |eigenvalue * step| up to which the integration is stable in the whole left half plane
RUNGE_KUTTA_REACH = 2.6
Gyro = Callable[[float], float]  # pitch rate to measured pitch rate, rad/s, once a period
Direction = Literal['behind', 'front']
DIRECTIONS: tuple[Direction, ...] = ('behind', 'front')


@dataclass(frozen=True)
class ForcePulse:
    """A constant horizontal force at the centre of mass, N, from time 0 for a duration, s."""

    force: float
    duration: float = math.inf

    def __post_init__(self) -> None:
        finite('force', self.force)
        if not self.duration > 0.0:
            raise KhrError.refused('duration', self.duration, '(0, inf]')


@dataclass(frozen=True)
class PushLoop:
    """The robot and its loop.

    Raises:
        KhrError: if a value is out of range, or the integration step is so long that the
            loop would blow up (the message gives the longest).
    """

    pendulum: Pendulum = field(default_factory=Pendulum)
    pid: Pid = field(default_factory=Pid)
    gain: float = 0.0  # K_A, rad per rad/s = s
    period: float = 0.015  # s, the board's
    delay: int = 1  # periods between measurement and correction
    inclination: float = 0.0  # rad, physical form only
    initial_lean: float = 0.0  # rad, physical form only
    form: Form = 'physical'
    step: float = 3e-3  # s, of the integration, at most; a whole number fill a period

    def __post_init__(self) -> None:
        finite('gain', self.gain)
        positive('period', self.period)
        if self.delay < 0:
            raise KhrError.refused('delay', self.delay, '0, 1, 2, ...')
        inclination_within(self.inclination)
        within('initial_lean', self.initial_lean, -RIGHT_ANGLE, RIGHT_ANGLE)
        one_of('form', self.form, FORMS)
        if self.form == 'published':  # (4.4) knows neither
            within('inclination of the published form', self.inclination, 0.0, 0.0)
            within('initial_lean of the published form', self.initial_lean, 0.0, 0.0)
        positive('step', self.step)
        longest = min(self.period, self._longest_step())
        if self.step > longest:
            raise KhrError(
                f'step: {self.step!r} makes the integration unstable or longer '
                f'than a period; accepted: (0, {longest:.3g}]'
            )

    def _longest_step(self) -> float:
        inertia = self.pendulum.inertia
        stiffness = self.pid.proportional + self.pendulum.gravity_moment
        poles = np.roots([inertia, self.pid.derivative, stiffness, self.pid.integral])
        return RUNGE_KUTTA_REACH / float(np.max(np.abs(poles)))

    @property
    def substeps(self) -> int:
        """Return the integration steps in a period."""
        return math.ceil(self.period / self.step * (1.0 - 1e-12))


def tipping_length(pendulum: Pendulum, ankle: float = 0.0) -> float:
    """Return L_0 of (4.1), or with the ankle leaned back by th_A (rad) L of (4.6), m."""
    length, half_foot = pendulum.length, pendulum.half_foot
    squared = length**2 + half_foot**2 + 2.0 * half_foot * length * math.sin(ankle)  # (4.6)
    return math.sqrt(squared)


def tipping_angle(pendulum: Pendulum) -> float:
    """Return th_0 = atan(b/l) of (4.2), rad."""
    return math.atan2(pendulum.half_foot, pendulum.length)


def tipping_force(pendulum: Pendulum) -> float:
    """Return the constant push that just lifts the heel, m g b/l, N."""
    return pendulum.weight * pendulum.half_foot / pendulum.length


class Model(ABC):
    """Common part of both forms: a state integrated by fourth-order Runge-Kutta."""

    def __init__(self, loop: PushLoop, push: ForcePulse, state: State) -> None:
        self._loop, self._push = loop, push
        self.side = math.copysign(1.0, push.force)
        self._state = state
        self._correction = 0.0
        self.fell = False

    @property
    def rate(self) -> float:
        """Return the pitch rate towards the pushed side, rad/s."""
        return self._state[1]

    def advance(self, time: float, step: float, correction: float) -> None:
        """Go one step on under the ankle's correction (rad, away from the pushed side)."""
        self._correction = correction
        lasting = min(max(self._push.duration - time, 0.0), step)  # so that its impulse is exact
        force = abs(self._push.force) * lasting / step
        state = self._state
        first = self.derivative(state, force)
        second = self.derivative(_along(state, first, 0.5 * step), force)
        third = self.derivative(_along(state, second, 0.5 * step), force)
        fourth = self.derivative(_along(state, third, step), force)
        self._state = tuple(
            value + step / 6.0 * (one + 2.0 * (two + three) + four)
            for value, one, two, three, four in zip(
                state, first, second, third, fourth, strict=True
            )
        )
        self.settle()

    @abstractmethod
    def derivative(self, state: State, force: float) -> State:
        """Return the state's rate of change."""

    @abstractmethod
    def settle(self) -> None:
        """Apply the ground and judge the fall after a step."""

    @abstractmethod
    def observe(self) -> tuple[float, float, float]:
        """Return x_COM, pitch rate and th_A."""


def _along(state: State, slope: State, step: float) -> State:
    return tuple(value + step * rate for value, rate in zip(state, slope, strict=True))


class Published(Model):
    """State: th, th' about the edge; th_A, th_A', int e of the ankle's servo (3.11)."""

    def __init__(self, loop: PushLoop, push: ForcePulse) -> None:
        self._rest = -tipping_angle(loop.pendulum)
        super().__init__(loop, push, (self._rest, 0.0, 0.0, 0.0, 0.0))

    def derivative(self, state: State, force: float) -> State:
        """Return the rate of change under (4.5) and (3.11)."""
        angle, rate, ankle, ankle_rate, integral = state
        pendulum, pid = self._loop.pendulum, self._loop.pid
        along = GRAVITY * math.sin(angle) + force / pendulum.mass * math.cos(angle)
        acceleration = along / tipping_length(pendulum, ankle)  # (4.5)
        if angle <= self._rest and rate <= 0.0 and acceleration < 0.0:
            rate = acceleration = 0.0  # the foot is down, (4.3)
        error = self._correction - ankle
        held = pendulum.gravity_moment * math.sin(ankle)
        moment = pid.torque(error, integral, -ankle_rate) - held  # (3.11)
        return rate, acceleration, ankle_rate, moment / pendulum.inertia, error

    def settle(self) -> None:
        """Land the foot at -th_0; past 0 the robot falls (4.3)."""
        angle, rate, *servo = self._state
        if angle <= self._rest:
            self._state = (self._rest, max(rate, 0.0), *servo)
        self.fell = angle > 0.0

    def observe(self) -> tuple[float, float, float]:
        """Return x_COM = L sin(th), the pitch rate and th_A."""
        angle, rate, ankle = self._state[:3]
        return tipping_length(self._loop.pendulum, ankle) * math.sin(angle), rate, ankle


class Physical(Model):
    """State: the lean q towards the pushed side, q', int e of the servo that holds it."""

    def __init__(self, loop: PushLoop, push: ForcePulse) -> None:
        side = math.copysign(1.0, push.force)
        self._lean, self._slope = side * loop.initial_lean, side * loop.inclination
        self._toe = loop.pendulum.half_foot * math.cos(self._slope)
        # At rest before the push the servo holds the weight, by its integrator or by its sag.
        self._held = -loop.pendulum.gravity_moment * math.sin(self._lean + self._slope)
        super().__init__(loop, push, (self._lean, 0.0, 0.0))

    def derivative(self, state: State, force: float) -> State:
        """Return the rate of change, the servo's torque limited by the foot."""
        lean, rate, integral = state
        pendulum, pid = self._loop.pendulum, self._loop.pid
        tilt = lean + self._slope
        load = pendulum.gravity_moment * math.sin(tilt) + force * pendulum.length * math.cos(tilt)
        error = self._lean - self._correction - lean
        torque = self._held + pid.torque(error, integral, -rate)
        torque = self._on_foot(lean, rate, load, torque, force)
        return rate, (load + torque) / pendulum.inertia, error

    def _on_foot(
        self, lean: float, rate: float, load: float, torque: float, force: float
    ) -> float:
        """Return as much of the torque as the foot can carry: |torque| <= N b."""
        pendulum = self._loop.pendulum
        lever = math.sin(lean) / pendulum.length  # N falls by lever * (load + torque)
        still = (
            pendulum.weight * math.cos(self._slope)
            - force * math.sin(self._slope)
            - pendulum.mass * pendulum.length * math.cos(lean) * rate**2
        )
        normal = still - lever * (load + torque)
        if abs(torque) <= normal * pendulum.half_foot:
            return torque
        side = math.copysign(pendulum.half_foot, torque)
        return max(still - lever * load, 0.0) / (1.0 + lever * side) * side

    def settle(self) -> None:
        """Judge the fall: the centre of mass past the toe or the heel."""
        self.fell = not -2.0 * self._toe <= self.observe()[0] <= 0.0

    def observe(self) -> tuple[float, float, float]:
        """Return x_COM, the pitch rate and th_A."""
        lean, rate, _ = self._state
        reach = self._loop.pendulum.length * math.sin(lean + self._slope)
        return reach - self._toe, rate, self._lean - lean


def ideal_gyro(rate: float) -> float:
    """Measure the rate exactly."""
    return rate


@dataclass(frozen=True)
class Recovery:
    """One push; arrays sampled every integration step.

    ``x_com`` (m) is measured from the toe for a push from behind; the robot stands while it is in
    the band -2 b <= x <= 0, on an incline -2 b cos(phi), and (4.7) asks for its half next to the
    edge. For a push from the front it
    is measured from the heel with its sign turned, so the same band holds. ``rate`` is the pitch
    rate (rad/s) and ``ankle`` the ankle's lean th_A (rad, backward positive), both turned alike.
    """

    time: Array
    x_com: Array
    rate: Array
    ankle: Array
    fell: bool


def simulate_push(
    loop: PushLoop, push: ForcePulse, *, gyro: Gyro = ideal_gyro, duration: float = 3.0
) -> Recovery:
    """Simulate a push until it is over with or the robot has fallen past its edge.

    Args:
        gyro: called once a period with the true pitch rate, rad/s, forward positive; returns
            what it measures, and may keep a state of its own.
        duration: s.

    Returns:
        The recovery; it ends at the fall, where x_COM passes the toe (4.7) or, physical form,
        the heel.
    """
    positive('duration', duration)
    model = (Published if loop.form == 'published' else Physical)(loop, push)
    waiting, correction = deque([0.0] * loop.delay), 0.0
    rows = [model.observe()]
    step = loop.period / loop.substeps
    periods = math.ceil(duration / loop.period * (1.0 - 1e-12))
    for number in range(periods * loop.substeps):
        if number % loop.substeps == 0:
            measured = model.side * gyro(model.side * model.rate)
            waiting.append(loop.gain * measured)
            correction = waiting.popleft()
        model.advance(number * step, step, correction)
        rows.append(model.observe())
        if model.fell:
            break
    x_com, rate, ankle = np.array(rows, dtype=np.float64).T
    time = step * np.arange(len(rows), dtype=np.float64)
    return Recovery(time, x_com, rate, ankle, model.fell)


def largest_push(
    loop: PushLoop,
    *,
    duration: float = 0.1,
    direction: Direction = 'behind',
    gyro: Callable[[], Gyro] = lambda: ideal_gyro,
    watch: float = 3.0,
    tolerance: float = 0.01,
) -> float:
    """Return the largest force survived, N, by bisection to a tolerance.

    Args:
        duration: of the push, s.
        gyro: makes a fresh gyro for each push.
        watch: s for which the robot is watched.

    Returns:
        The force, at least 0, positive for either direction; 0 if it falls unpushed.
    """
    one_of('direction', direction, DIRECTIONS)
    positive('tolerance', tolerance)
    side = 1.0 if direction == 'behind' else -1.0

    def stands(force: float) -> bool:
        return not simulate_push(
            loop, ForcePulse(side * force, duration), gyro=gyro(), duration=watch
        ).fell

    start = tipping_force(loop.pendulum)
    return bracket_limit(stands, start, (0.0, math.inf), start, tolerance, growth=2.0).held
