"""The largest push beyond the foot: capture point, flywheel and steps, in closed form.

About the edge of the foot, tipping (4.4) is for small angles
    x'' = omega^2 (x - p) + F l^2/J,  omega^2 = m g l/J,
p the place of the edge, J the inertia about it. Only one of its two motions grows, that of the
capture point xi = x + x'/omega (Pratt et al. 2006):
    xi' = omega (xi - p) + F l^2/(J omega).
A body whose capture point is on its foot can stop there. Beyond the edge by d at one moment, it is
beyond by d exp(omega t) a time t later. So each means of recovery has a margin: the distance by
which the capture point may be beyond the edge at the moment of the decision.

- A flywheel (trunk and arms turned by the hip) moves the force of the ground beyond the edge while
  it accelerates, and gives the same back when it stops at the end of its range.
- A step places a new edge a length L ahead at the time T after the decision (Koolen et al. 2012).

The ankle alone has the margin 0, which is (4.7) for a moving body; its largest push is
:func:`capture_force`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from khr_common.checks import non_negative, positive
from khr_models.pendulum import Pendulum
from khr_models.standing.push import tipping_force


@dataclass(frozen=True)
class Flywheel:
    """A body part that turns on the pendulum; the defaults are trunk and arms of the KHR-3HV."""

    inertia: float = 0.0038  # kg m^2, of the trunk against the legs
    speed: float = 7.48  # rad/s, largest
    span: float = 1.4  # rad, from the start to the stop
    torque: float = math.inf  # N m, largest; the speed limits a servo more

    def __post_init__(self) -> None:
        for name in ('inertia', 'speed', 'span', 'torque'):
            if (name, getattr(self, name)) != ('torque', math.inf):
                positive(name, getattr(self, name))


def growth_rate(pendulum: Pendulum, inertia: float) -> float:
    """Return omega of the tipping about the edge, 1/s; inertia about it, kg m^2."""
    positive('inertia', inertia)
    return math.sqrt(pendulum.gravity_moment / inertia)


def capture_point(place: float, speed: float, omega: float) -> float:
    """Return xi = x + x'/omega, m, for a centre of mass at x, m, with a speed in m/s."""
    positive('omega', omega)
    return place + speed / omega


def flywheel_margin(pendulum: Pendulum, inertia: float, wheel: Flywheel) -> float:
    """Return the margin of one turn of a flywheel, m.

    It accelerates with its largest torque to its largest speed, and brakes so that it stops at the
    end of its span. The margin is the integral of exp(-omega t) omega tau/(m g) over the turn, tau
    its torque,
        tau/(m g) (1 - exp(-omega T_1)) (1 - exp(-omega T_2)),
    T_1 the time of acceleration and T_2 the time from the start to the start of the braking. With
    an unlimited torque T_1 is 0, and the impulse tau T_1 remains.

    Args:
        pendulum: mass and height.
        inertia: about the edge, kg m^2.
        wheel: the flywheel.
    """
    omega = growth_rate(pendulum, inertia)
    if math.isinf(wheel.torque):
        kick = omega * wheel.inertia * wheel.speed
        return kick / pendulum.weight * -math.expm1(-omega * wheel.span / wheel.speed)
    acceleration = wheel.torque / wheel.inertia
    speed = min(wheel.speed, math.sqrt(wheel.span * acceleration))
    return (
        wheel.torque
        / pendulum.weight
        * math.expm1(-omega * speed / acceleration)
        * math.expm1(-omega * wheel.span / speed)
    )


def step_margin(length: float, time: float, omega: float, steps: float = 1) -> float:
    """Return the margin of steps, m: L (q + q^2 + ... + q^n), q = exp(-omega T).

    Args:
        length: L of each step, by which its edge is ahead of the last one, m.
        time: T from a decision to the landing, which is the next decision, s.
        omega: 1/s.
        steps: their number n; ``math.inf`` for endless steps, L/(exp(omega T) - 1).

    Raises:
        KhrError: if length or steps are negative, or time or omega are not positive.
    """
    non_negative('length', length)
    non_negative('steps', steps if math.isfinite(steps) else 0.0)
    positive('time', time)
    positive('omega', omega)
    return length * -math.expm1(-steps * omega * time) / math.expm1(omega * time)


def capture_force(pendulum: Pendulum, inertia: float, duration: float) -> float:
    """Return the largest push that a body on the edge of its foot survives, in closed form, N.

    Linear tipping, J q'' = m g (l q - b) + F l, is led by one unstable motion; it decides by
    F = (m g b/l) / (1 - exp(-omega T)) with omega^2 = m g l/J. A short push so has the impulse
    m g b/(l omega), which of a point mass is v < omega b, its capture point within the foot.

    Args:
        pendulum: mass, height over the sole, distance from the edge.
        inertia: J about the edge, kg m^2; m (l^2 + b^2) is that of a point mass, and the physical
            form of :mod:`khr_models.standing.push` has m l^2.
        duration: T, s.

    Raises:
        KhrError: if inertia or duration is not positive.
    """
    positive('duration', duration)
    omega = growth_rate(pendulum, inertia)
    return tipping_force(pendulum) / -math.expm1(-omega * duration)


def largest_force(
    pendulum: Pendulum, inertia: float, duration: float, margin: float, decision: float = 0.0
) -> float:
    """Return the largest push of a body with a margin beyond its foot, in closed form, N.

    Up to the decision the ground acts at the edge, the best that a foot can do. So the margin
    counts as much as a foot longer by margin exp(-omega t), t the time of the decision.

    Args:
        pendulum: mass, height over the sole, distance from the edge.
        inertia: about the edge, kg m^2.
        duration: of the push, s.
        margin: beyond the edge at the decision, m.
        decision: time from the start of the push to the decision, s.

    Raises:
        KhrError: if a value is negative, or inertia or duration are not positive.
    """
    non_negative('margin', margin)
    non_negative('decision', decision)
    ahead = margin * math.exp(-growth_rate(pendulum, inertia) * decision)
    force = capture_force(pendulum, inertia, duration)
    return force * (1.0 + ahead / pendulum.half_foot)
