"""The loops of standing, linear: force to the ankles (3.13), pitch rate to the hips (3.14).

Bodies on a foot that stays flat, in the sagittal plane: joints from the ankle upward, each a servo
as the simulated robot has it, without its dry friction. The difference of toe and heel force is
what the ankle's torque presses on two points, Delta = -torque/p, through the low-pass of the
sensors; the pitch rate is that of the last body, through the low-pass of the gyro. The board
samples both, and moves its targets in straight lines, a delay later. All this is linear, so the
eigenvalues of one period say how every motion dies away.

With the load on springs the force difference answers a lean at once, and the ankle's correction
changes the lean that it measures: a strong or a fast loop swings. What (3.14) does at the hip is to
resist the rate of that swing. Neither holds more than the foot can press: this model has no
edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import tau

import numpy as np
from scipy.linalg import expm

from khr_common.checks import finite, positive
from khr_common.errors import KhrError
from khr_models.checks import Array
from khr_models.pendulum import GRAVITY

SLOWEST = 0.05  # Hz, of a swing; slower motions count as creeping
Modes = np.ndarray[tuple[int, ...], np.dtype[np.complex128]]


@dataclass(frozen=True, eq=False)
class Chain:
    """Bodies above a fixed foot, in the posture in which they rest."""

    joints: Array  # places of the joints, ahead of and above the first, m, (n, 2)
    masses: Array  # of the body above each joint, kg, (n,)
    centres: Array  # of those masses, m, (n, 2)
    inertias: Array  # about those centres, kg m^2, (n,)

    def __post_init__(self) -> None:
        count = len(self.masses)
        shapes = [each.shape for each in (self.joints, self.centres, self.inertias)]
        if count < 1 or shapes != [(count, 2), (count, 2), (count,)]:
            raise KhrError(
                f'chain: shapes {shapes} are not accepted; accepted: (n, 2), (n, 2), (n,) for n '
                'masses'
            )
        for each in (*self.masses, *self.inertias):
            positive('mass and inertia', float(each))

    @property
    def mass_matrix(self) -> Array:
        """Return M, kg m^2, (n, n): of the joint angles, forward positive."""
        count = len(self.masses)
        matrix = np.zeros((count, count))
        for body in range(count):
            arms = self.centres[body] - self.joints[: body + 1]
            matrix[: body + 1, : body + 1] += self.masses[body] * arms @ arms.T
            matrix[: body + 1, : body + 1] += self.inertias[body]
        return matrix

    @property
    def gravity_stiffness(self) -> Array:
        """Return gravity's destabilising torque per joint angle, N m/rad, (n, n).

        The height of a centre falls by its height over the upper of two joints, per product of
        their angles.
        """
        count = len(self.masses)
        matrix = np.zeros((count, count))
        for body in range(count):
            upper = np.maximum.outer(range(body + 1), range(body + 1))
            over = self.centres[body, 1] - self.joints[upper, 1]
            matrix[: body + 1, : body + 1] += self.masses[body] * GRAVITY * over
        return matrix


@dataclass(frozen=True, eq=False)
class JointServos:
    """The servos of a chain, from the ankle upward; of two legs the sums."""

    stiffness: Array  # of the position loops, N m/rad, (n,)
    # gear_stiffness, gear_damping: between rotor and link, N m/rad and N m s/rad, (n,)
    gear_stiffness: Array
    gear_damping: Array
    rotor_inertia: Array  # kg m^2, (n,)
    back_emf: Array  # braking torque per rotor speed, N m s/rad, (n,)


@dataclass(frozen=True, eq=False)
class StandingLoop:
    """A standing robot with both loops."""

    # chain, servos: the robot
    chain: Chain
    servos: JointServos
    lever: float  # of the points under toe and heel, p, m
    ankle_gain: float  # rad per N of Delta
    hip_gain: float  # rad per rad/s
    force_time: float  # time constant of the force sensors, s
    gyro_time: float  # that of the gyro, s
    period: float = 0.015  # of the board, s
    delay: int = 1  # periods between a sample and the motion that answers it, 0 or 1

    def __post_init__(self) -> None:
        positive('lever', self.lever)
        finite('ankle_gain', self.ankle_gain)
        finite('hip_gain', self.hip_gain)
        positive('force_time', self.force_time)
        positive('gyro_time', self.gyro_time)
        positive('period', self.period)
        if self.delay not in (0, 1):
            raise KhrError.refused('delay', self.delay, '0, 1')

    @cached_property
    def _plant(self) -> tuple[Array, Array]:
        """Return A (m, m) and B (m, 2): the state's rate, by itself and by ankle and hip target.

        The state is q, q', rotor angles and speeds, the filtered Delta and the filtered rate.
        """
        servos, n = self.servos, len(self.chain.masses)
        q, w, rotor, speed = (slice(k * n, (k + 1) * n) for k in range(4))
        force, rate = 4 * n, 4 * n + 1
        load = np.zeros((n, 4 * n + 2))  # torques of the rotors on the links
        load[:, q], load[:, w] = -np.diag(servos.gear_stiffness), -np.diag(servos.gear_damping)
        load[:, rotor], load[:, speed] = -load[:, q], -load[:, w]
        a = np.zeros((4 * n + 2, 4 * n + 2))
        a[q, w] = a[rotor, speed] = np.eye(n)
        moment = load.copy()
        moment[:, q] += self.chain.gravity_stiffness
        a[w] = np.linalg.solve(self.chain.mass_matrix, moment)
        drive = -load
        drive[:, rotor] -= np.diag(servos.stiffness)
        drive[:, speed] -= np.diag(servos.back_emf)
        a[speed] = drive / servos.rotor_inertia[:, np.newaxis]
        a[force] = -load[0] / self.lever / self.force_time
        a[force, force] -= 1.0 / self.force_time
        a[rate, w] = 1.0 / self.gyro_time
        a[rate, rate] = -1.0 / self.gyro_time
        b = np.zeros((4 * n + 2, 2))
        for column, joint in enumerate((0, n - 1)):
            b[3 * n + joint, column] += servos.stiffness[joint] / servos.rotor_inertia[joint]
        return a, b

    @cached_property
    def _one_period(self) -> Array:
        """Return the state, the targets and the delayed targets after one period."""
        a, b = self._plant
        size, h = len(a), self.period
        joint = np.zeros((size + 4, size + 4))  # the input, and its slope, held over a period
        joint[:size, :size], joint[:size, size : size + 2] = a, b
        joint[size : size + 2, size + 2 :] = np.eye(2) / h
        whole = expm(joint * h)
        free, held, ramp = np.split(whole[:size], [size, size + 2], axis=1)
        answer = np.zeros((2, size))  # opposes a load on the toes, and a forward rate
        answer[0, -2], answer[1, -1] = -self.ankle_gain, -self.hip_gain
        step = np.zeros((size + 4, size + 4))
        now, due = slice(size, size + 2), slice(size + 2, size + 4)
        step[:size, :size], step[:size, now] = free, held - ramp
        step[due, :size] = answer
        if self.delay:
            step[:size, due], step[now, due] = ramp, np.eye(2)
        else:
            step[:size, :size] += ramp @ answer
            step[now, :size] = answer
        return step

    @cached_property
    def modes(self) -> Modes:
        """Return the exponents s of the motions exp(s t), 1/s, the slowest to die away first."""
        values = np.linalg.eigvals(self._one_period).astype(np.complex128)
        values = values[np.abs(values) > 1e-9]  # drops modes that decay within a period
        exponents = np.log(values) / self.period
        return np.asarray(exponents[np.argsort(-exponents.real)])

    @property
    def growth(self) -> float:
        """Return the rate at which the worst motion grows, 1/s; below 0 all die away."""
        return float(self.modes[0].real)

    @property
    def _swings(self) -> Modes:
        return self.modes[self.modes.imag > tau * SLOWEST]

    @property
    def damping_ratio(self) -> float:
        """Return -Re(s)/|s| of the swing that lasts longest; 1 if nothing swings."""
        swings = self._swings
        return float(-swings[0].real / abs(swings[0])) if swings.size else 1.0

    @property
    def frequency(self) -> float:
        """Return the frequency of that swing, Hz; 0 if nothing swings."""
        swings = self._swings
        return float(swings[0].imag / tau) if swings.size else 0.0
