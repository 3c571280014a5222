"""Model of the 17 servos KRS-2552RHV: a DC motor behind a compliant gear with backlash.

Rotor and gears are one inertia, reflected to the output shaft, where the potentiometer of the
position loop measures. The link is coupled to the shaft by the compliance of shaft, horn and
bracket, in series with the backlash. Back-EMF (the linear torque-speed line) and dry friction act
on the rotor and are integrated implicitly, so that the light feet are coupled only to a spring
that the physics step resolves. The joint motors of the engines are not used: they are rigid and
have no rotor inertia.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from math import radians
from typing import Any, NamedTuple

import numpy as np

from khr_common.published import NO_LOAD_SPEED, STALL_TORQUE
from khr_common.rotation import Array
from khr_description.robot import JOINTS
from khr_sim.parameters import SimulatorParameters

BACK_EMF = STALL_TORQUE / NO_LOAD_SPEED  # N m s/rad, of the torque-speed line
SUPPLY = 11.1  # V
POTENTIOMETER = 5.0 / radians(270.0)  # V/rad: 5 V over the servo's range (assumed)
# A step h resolves a spring k and a damper d on an inertia I while k h^2 <= I and d h <= I / 2 (a
# symplectic step is stable while k h^2 + 2 d h < 4 I). Stiffness and damping above these limits are
# clamped; with the defaults this concerns only the head, because of its small inertia.
SPRING_LIMIT, DAMPER_LIMIT = 1.0, 0.5

# Rows of the servo table. State: rotor angle in rad, rotor speed in rad/s, integral of the PID loop
# in N m, last command in rad.
ANGLE, RATE, INTEGRAL, COMMAND = range(4)
# Inputs: command in rad, joint angle in rad, joint speed in rad/s. Output: joint torque in N m.
GOAL, POSITION, VELOCITY, TORQUE = range(4, 8)
# Settings: stiffness of the position loop and of the gear in N m/rad, damping of the gear and
# derivative gain in N m s/rad, largest motor torque in N m.
STIFFNESS, GEAR, DAMPING, DERIVATIVE, STRENGTH = range(8, 13)


@cache
def jit(function: Callable[..., Any]) -> Any:
    """Return the function as a Numba dispatcher, which compiles it on the first call.

    Numba keeps IEEE 754 semantics by default: it neither reorders nor fuses floating-point
    operations. The golden hashes rely on that, so no function may use ``fastmath``.

    Later processes load the machine code from Numba's cache: ``NUMBA_CACHE_DIR``, ``__pycache__``
    beside the module or, if the installation is read-only, the cache folder of the user. Without a
    writable folder every process compiles the function again.
    """
    import numba  # takes 0.2 s, which modules that only read servo constants should not pay

    try:
        return numba.njit(cache=True)(function)
    except RuntimeError:  # no writable cache folder
        return numba.njit(function)


def law(servos: Array, constants: Array) -> None:
    """Advance the rotors by one physics step; compiled by :func:`jit`.

    Args:
        servos: servo table, (13, n); the rows of state and torque are changed in place.
        constants: scalar constants set by :meth:`Servos.configure`, (8,).
    """
    h, gain, loss = constants[0], constants[1], constants[2]  # unpacking could raise
    stick, play, differs = constants[3], constants[4], constants[5]
    integrates, integral_gain = constants[6], constants[7]
    for i in range(servos.shape[1]):
        goal, angle, rate = servos[GOAL, i], servos[ANGLE, i], servos[RATE, i]
        most = servos[STRENGTH, i]
        offset = 0.0
        if integrates:
            integral = servos[INTEGRAL, i] + integral_gain * h * (goal - angle)
            offset = servos[INTEGRAL, i] = min(max(integral, -most), most)
        if differs:
            offset += servos[DERIVATIVE, i] * ((goal - servos[COMMAND, i]) / h - rate)
        servos[COMMAND, i] = goal
        twist, slide = angle - servos[POSITION, i], rate - servos[VELOCITY, i]
        if play:
            twist -= min(max(twist, -play), play)
            if twist == 0.0:
                slide = 0.0
        load = servos[GEAR, i] * twist + servos[DAMPING, i] * slide
        drive = min(max(servos[STIFFNESS, i] * (goal - angle) + offset, -most), most)
        rate = (rate + gain * (drive - load)) * loss
        if rate > stick:  # dry friction removes at most the whole speed
            rate -= stick
        elif rate < -stick:
            rate += stick
        else:
            rate = 0.0
        servos[TORQUE, i] = load
        servos[ANGLE, i], servos[RATE, i] = angle + h * rate, rate


class Tables(NamedTuple):
    """What the compiled periods of an engine read and write, one robot after the other.

    All robots have the same constants, as one call of the law advances the servos of all.
    """

    servos: Array  # arguments of :func:`law`, (13, 17 n) and (8,)
    constants: Array
    forces: Array  # sums of the forces of the ground on toes and heels, N, (4 n, 3)

    @classmethod
    def of(cls, robots: int) -> Tables:
        """Return the tables of a number of robots, all zero."""
        joints = len(JOINTS) * robots
        return cls(np.zeros((STRENGTH + 1, joints)), np.zeros(8), np.zeros((4 * robots, 3)))

    def of_robot(self, number: int) -> Tables:
        """Return the part of one robot."""
        joints, regions = (slice(n * number, n * (number + 1)) for n in (len(JOINTS), 4))
        return Tables(self.servos[:, joints], self.constants, self.forces[regions])


class PositionLoop(NamedTuple):
    """Gains of the position loop, at the output shaft."""

    stiffness: Array  # N m/rad, (17,)
    derivative: Array  # N m s/rad, (17,)
    integral: float  # the same for all servos, N m/(rad s)


class Servos:
    """All servos: command and joint state in, joint torque out.

    Args:
        parameters: of the simulator.
        carried: inertia of the links outward of each joint, kg m^2, (17,).
        tables: its part of those of all robots; by default tables of its own.

    Attributes:
        table, constants: arguments of :func:`law`.
        state: rows of the table with the state, (4, 17).
        torque: row of the table with the torques, N m, (17,).
    """

    def __init__(
        self, parameters: SimulatorParameters, carried: Array, tables: Tables | None = None
    ) -> None:
        self._carried = carried
        self.table, self.constants, _ = tables or Tables.of(1)
        self.state: Array = self.table[: COMMAND + 1]
        self.torque: Array = self.table[TORQUE]
        self._inputs = [self.table[row].data for row in (GOAL, POSITION, VELOCITY)]
        self._step = partial(jit(law), self.table, self.constants)
        self._step()  # load or compile the law before time matters; a table of zeros stays zero
        self._own_stretch: Array | None = None
        self._strength = np.full(len(JOINTS), STALL_TORQUE)
        self.configure(parameters)

    def configure(self, parameters: SimulatorParameters) -> None:
        """Apply changed parameters and keep the state."""
        p, h = parameters, parameters.physics_step
        gear = np.minimum(gear_stiffness(p), SPRING_LIMIT * self._carried / h**2)
        damping = np.minimum(p.gear_damping, DAMPER_LIMIT * self._carried / h)
        loop = position_loop(p, self._own_stretch)
        self._integrates = loop.integral > 0.0
        self.table[STIFFNESS:] = loop.stiffness, gear, damping, loop.derivative, self._strength
        gain = h / p.rotor_inertia  # speed gained per N m and step
        loss = 1.0 / (1.0 + gain * BACK_EMF)  # back-EMF, implicit
        stick = gain * p.servo_friction * loss
        play = radians(p.backlash_deg) / 2.0
        differs = loop.derivative.any()
        self.constants[:] = (
            h, gain, loss, stick, play, differs, self._integrates, loop.integral,
        )  # fmt: skip

    def set_each(self, parameters: SimulatorParameters, stretch: Array, free: Array) -> None:
        """Apply the settings that a controller board makes for each servo.

        A free servo has no drive torque. Friction and back-EMF stay, as in a motor with shorted
        terminals; it is unknown whether the real servo opens the terminals instead.

        Args:
            parameters: of the simulator, for all other settings.
            stretch: stretch of each servo, (17,); replaces the parameters.
            free: whether each servo is free, (17,).
        """
        self._own_stretch = stretch
        self._strength = np.where(free, 0.0, STALL_TORQUE)
        self.configure(parameters)

    def reset(self, command: Array, torque: Array) -> Array:
        """Set the state to static equilibrium under a load, the backlash left out.

        The gear is wound up from the middle of its play, so it lacks the torque of half the play.

        Args:
            command: angles commanded by the board, rad, (17,).
            torque: load on each servo, N m, (17,).

        Returns:
            The joint angles in equilibrium without play, rad, (17,).
        """
        stiffness, gear = self.table[STIFFNESS], self.table[GEAR]
        held = np.clip(torque, -STALL_TORQUE, STALL_TORQUE)
        integral = held if self._integrates else np.zeros(len(JOINTS))
        angle = command - (held - integral) / stiffness
        self.state[:] = angle, 0.0 * angle, integral, command
        return np.asarray(angle - held / gear)

    def update(self, command: Array, position: Array, velocity: Array) -> Array:
        """Advance by one physics step and return the joint torques.

        Args:
            command: angles commanded by the board, rad, (17,).
            position: joint angles, rad, (17,).
            velocity: joint speeds, rad/s, (17,).

        Returns:
            The torques to apply during the step, N m, (17,); the next step overwrites the array.
        """
        goals, positions, velocities = self._inputs
        goals[:], positions[:], velocities[:] = command, position, velocity
        self._step()
        return self.torque


def position_loop(parameters: SimulatorParameters, stretch: Array | None = None) -> PositionLoop:
    """Return the gains of the position loop of the servos.

    Args:
        parameters: of the simulator; they choose the loop.
        stretch: stretch of each servo, (17,), by default from the parameters; has no effect on the
            identified loop.
    """
    p = parameters
    if p.servo_model == 'pid':
        # (3.11): the identified gains relate armature volts to volts of potentiometer error.
        kp, ki, kd = (
            gain * POTENTIOMETER * STALL_TORQUE / SUPPLY for gain in (p.pid_kp, p.pid_ki, p.pid_kd)
        )
        return PositionLoop(
            kp * _of_groups(p.pid_scale_hip, p.pid_scale_knee, p.pid_scale_ankle),
            kd * _of_groups(p.pid_kd_scale_hip, p.pid_kd_scale_knee, p.pid_kd_scale_ankle),
            ki,
        )
    stiffness = p.stiffness_per_stretch * (stretches(p) if stretch is None else stretch)
    return PositionLoop(stiffness, p.derivative_time * stiffness, 0.0)


def _of_groups(hip: float, knee: float, ankle: float) -> Array:
    """Expand a value per leg joint group to the 17 servos; arms and head get 1."""
    groups = {'hip': hip, 'knee': knee, 'ankle': ankle}
    return np.array([groups.get(name.split('_')[1], 1.0) for name in JOINTS])


def gear_stiffness(parameters: SimulatorParameters) -> Array:
    """Return the stiffness between potentiometer and link of each of the 17 servos, N m/rad."""
    ankle = parameters.gear_stiffness_ankle or parameters.gear_stiffness
    return np.array(
        [ankle if 'ankle' in name else parameters.gear_stiffness for name in JOINTS], dtype=float
    )


def stretches(parameters: SimulatorParameters) -> Array:
    """Return the stretch setting of each of the 17 servos."""
    by_joint = {
        'hip_roll': parameters.stretch_hip,
        'hip_pitch': parameters.stretch_hip,
        'knee': parameters.stretch_knee,
        'ankle_pitch': parameters.stretch_ankle_pitch,
        'ankle_roll': parameters.stretch_ankle_roll,
    }
    return np.array([float(by_joint.get(name[2:], parameters.stretch_upper)) for name in JOINTS])
