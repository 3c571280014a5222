"""The 17 servos KRS-2552RHV, each a DC motor behind a gear.

Rotor and gears turn as one inertia, seen at the output shaft, where the position loop reads its
potentiometer; the link hangs from them by the compliance of shaft, horn and bracket, which also
holds the backlash. So the back-EMF (the linear torque-speed line) and the dry friction act on the
rotor, where they are integrated implicitly, and the light feet see only a spring that the physics
step resolves. The physics engine has no rotor inertia of its own, and its joint motors are rigid.
"""

from __future__ import annotations

from math import radians

import numpy as np
from numpy.typing import NDArray

from khr_sim.parameters import SimulatorParameters
from khr_sim.robot import JOINTS

Array = NDArray[np.float64]

STALL_TORQUE = 1.373  # N m at 11.1 V (maker)
NO_LOAD_SPEED = 7.48  # rad/s at 11.1 V (maker)
BACK_EMF = STALL_TORQUE / NO_LOAD_SPEED  # N m s/rad, the slope of the torque-speed line
SUPPLY = 11.1  # V
POTENTIOMETER = 5.0 / radians(270.0)  # V/rad: 5 V over the servo's range (assumed)
# A step h resolves a spring k and a damper d on an inertia I while k h^2 <= I and d h <= I / 2 (a
# symplectic step is stable while k h^2 + 2 d h < 4 I). What exceeds it is reduced to it: the
# spring of the head, which carries nothing, and the dampers of head, forearms and feet.
SPRING_LIMIT, DAMPER_LIMIT = 1.0, 0.5


class Servos:
    """All servos at once: command and joint state in, torque on the joints out.

    Args:
        parameters: the simulator's parameters.
        carried: what each joint carries outward, kg m^2, shape (17,).
    """

    def __init__(self, parameters: SimulatorParameters, carried: Array) -> None:
        self._carried = carried
        self._angle = np.zeros(len(JOINTS))  # of the rotors, seen at the output shaft
        self._rate = np.zeros(len(JOINTS))
        self._integral = np.zeros(len(JOINTS))
        self._command = np.zeros(len(JOINTS))
        self._torque = np.zeros(len(JOINTS))
        self._drive = np.zeros(len(JOINTS))
        self._spare = np.zeros(len(JOINTS))
        self.configure(parameters)

    def configure(self, parameters: SimulatorParameters) -> None:
        """Take changed parameters without losing the state."""
        h = parameters.physics_step
        self._gear = np.minimum(parameters.gear_stiffness, SPRING_LIMIT * self._carried / h**2)
        self._gear_damping = np.minimum(parameters.gear_damping,
                                        DAMPER_LIMIT * self._carried / h)
        self._play = radians(parameters.backlash_deg) / 2.0
        self._stiffness = parameters.stiffness_per_stretch * stretches(parameters)
        # (3.11): the identified gains relate armature volts to volts of potentiometer error.
        self._kp, self._ki, self._kd = (
            gain * POTENTIOMETER * STALL_TORQUE / SUPPLY
            for gain in (parameters.pid_kp, parameters.pid_ki, parameters.pid_kd))
        gain = h / parameters.rotor_inertia  # speed gained per N m and step
        loss = 1.0 / (1.0 + gain * BACK_EMF)  # back-EMF, implicit
        # NumPy is faster with an array of equal numbers than with the number.
        self._step, self._gain, self._loss, self._most, self._stick = (
            np.full(len(JOINTS), each)
            for each in (h, gain, loss, STALL_TORQUE, gain * parameters.servo_friction * loss))
        self._least, self._stick_back = -self._most, -self._stick
        self._pid = parameters.servo_model == 'pid'

    def reset(self, command: Array, torque: Array) -> Array:
        """Stand still under a load.

        Args:
            command: angles commanded by the board, rad, shape (17,).
            torque: what each servo has to hold, N m, shape (17,).

        Returns:
            The joint angles (17,) in rad at which the servos hold it.
        """
        self._command = command
        self._rate = np.zeros(len(JOINTS))
        held = _limited(torque, STALL_TORQUE)
        self._integral = held if self._pid and self._ki else np.zeros(len(JOINTS))
        sag = (held - self._integral) / (self._kp if self._pid else self._stiffness)
        self._angle = command - sag
        return np.asarray(self._angle - held / self._gear)

    def update(self, command: Array, position: Array, velocity: Array) -> Array:
        """Advance one physics step and return the torques on the joints.

        Args:
            command: angles commanded by the board, rad, shape (17,).
            position: joint angles, rad.
            velocity: joint speeds, rad/s.

        Returns:
            Torques (17,) in N m to apply to the joints during the step; the next update
            overwrites them.
        """
        # A third of the time of all that is not physics goes by here: every result has its place.
        torque, rate, spare = self._torque, self._rate, self._spare
        np.subtract(self._angle, position, out=torque)  # twist
        np.subtract(rate, velocity, out=spare)  # slide
        if self._play:
            torque -= _limited(torque, self._play)
            spare *= torque != 0.0
        torque *= self._gear
        spare *= self._gear_damping
        torque += spare
        drive = self._drive_pid(command) if self._pid else self._drive_stretch(command)
        drive -= torque
        drive *= self._gain
        drive += rate
        np.multiply(drive, self._loss, out=rate)
        np.maximum(rate, self._stick_back, out=spare)  # dry friction takes what speed it can,
        np.minimum(spare, self._stick, out=spare)      # and no more
        rate -= spare
        np.multiply(self._step, rate, out=spare)
        self._angle += spare
        return torque

    def _drive_stretch(self, command: Array) -> Array:
        drive = self._drive
        np.subtract(command, self._angle, out=drive)
        drive *= self._stiffness
        np.maximum(drive, self._least, out=drive)
        np.minimum(drive, self._most, out=drive)
        return drive

    def _drive_pid(self, command: Array) -> Array:
        error = command - self._angle
        error_rate = (command - self._command) / self._step - self._rate
        self._command = command
        self._integral = _limited(self._integral + self._ki * self._step * error, STALL_TORQUE)
        return _limited(self._kp * error + self._integral + self._kd * error_rate, STALL_TORQUE)


def stretches(parameters: SimulatorParameters) -> Array:
    """Return the stretch setting of each of the 17 servos."""
    by_joint = {'hip_roll': parameters.stretch_hip, 'hip_pitch': parameters.stretch_hip,
                'knee': parameters.stretch_knee, 'ankle_pitch': parameters.stretch_ankle_pitch,
                'ankle_roll': parameters.stretch_ankle_roll}
    return np.array([float(by_joint.get(name[2:], parameters.stretch_upper)) for name in JOINTS])


def _limited(values: Array, most: float) -> Array:
    return np.minimum(np.maximum(values, -most), most)
