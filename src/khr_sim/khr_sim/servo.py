"""The 17 servos KRS-2552RHV, each a DC motor behind a gear.

Rotor and gears turn as one inertia, seen at the output shaft, where the position loop reads its
potentiometer; the link hangs from them by the compliance of shaft, horn and bracket, which also
holds the backlash. So the back-EMF (the linear torque-speed line) and the dry friction act on the
rotor, where they are integrated implicitly, and the light feet see only a spring that the physics
step resolves. The physics engine has no rotor inertia of its own, and its joint motors are rigid.
"""

from __future__ import annotations

from collections.abc import Sequence
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
_NONE = (0.0,) * len(JOINTS)


class Servos:
    """All servos at once: command and joint state in, torque on the joints out.

    Args:
        parameters: the simulator's parameters.
        carried: what each joint carries outward, kg m^2, shape (17,).
    """

    def __init__(self, parameters: SimulatorParameters, carried: Array) -> None:
        self._carried = carried
        self._angle = [0.0] * len(JOINTS)  # of the rotors, seen at the output shaft
        self._rate = [0.0] * len(JOINTS)
        self._integral = [0.0] * len(JOINTS)
        self._command: Sequence[float] = [0.0] * len(JOINTS)
        self.configure(parameters)

    def configure(self, parameters: SimulatorParameters) -> None:
        """Take changed parameters without losing the state."""
        h = parameters.physics_step
        self._gear: list[float] = np.minimum(
            parameters.gear_stiffness, SPRING_LIMIT * self._carried / h**2
        ).tolist()
        self._gear_damping: list[float] = np.minimum(
            parameters.gear_damping, DAMPER_LIMIT * self._carried / h
        ).tolist()
        self._play = radians(parameters.backlash_deg) / 2.0
        self._stiffness: list[float] = (
            parameters.stiffness_per_stretch * stretches(parameters)
        ).tolist()
        self._pid = parameters.servo_model == 'pid'
        # (3.11): the identified gains relate armature volts to volts of potentiometer error.
        kp, self._ki, self._kd = (
            gain * POTENTIOMETER * STALL_TORQUE / SUPPLY
            for gain in (parameters.pid_kp, parameters.pid_ki, parameters.pid_kd)
        )
        if self._pid:
            self._stiffness = [kp] * len(JOINTS)
        self._step = h
        self._gain = h / parameters.rotor_inertia  # speed gained per N m and step
        self._loss = 1.0 / (1.0 + self._gain * BACK_EMF)  # back-EMF, implicit
        self._stick = self._gain * parameters.servo_friction * self._loss

    def reset(self, command: Array, torque: Array) -> Array:
        """Stand still under a load.

        Args:
            command: angles commanded by the board, rad, shape (17,).
            torque: what each servo has to hold, N m, shape (17,).

        Returns:
            The joint angles (17,) in rad at which the servos hold it.
        """
        self._command = command.tolist()
        self._rate = [0.0] * len(JOINTS)
        held = np.clip(torque, -STALL_TORQUE, STALL_TORQUE)
        integral = held if self._pid and self._ki else np.zeros(len(JOINTS))
        angle = command - (held - integral) / self._stiffness
        self._angle, self._integral = angle.tolist(), integral.tolist()
        return np.asarray(angle - held / self._gear)

    def update(
        self, command: Sequence[float], position: Sequence[float], velocity: Sequence[float]
    ) -> list[float]:
        """Advance one physics step and return the torques on the joints.

        Args:
            command: 17 angles commanded by the board, rad.
            position: joint angles, rad.
            velocity: joint speeds, rad/s.

        Returns:
            17 torques in N m to apply to the joints during the step.
        """
        # Plain numbers: 17 of them are so few that NumPy takes twice the time.
        step, gain, loss, stick, play, most = (
            self._step,
            self._gain,
            self._loss,
            self._stick,
            self._play,
            STALL_TORQUE,
        )
        torques, angles, rates = [], [], []
        for goal, joint, speed, angle, rate, stiffness, offset, gear, damping in zip(
            command,
            position,
            velocity,
            self._angle,
            self._rate,
            self._stiffness,
            self._offsets(command),
            self._gear,
            self._gear_damping,
            strict=False,
        ):
            twist, slide = angle - joint, rate - speed
            if play:
                twist -= min(max(twist, -play), play)
                slide *= twist != 0.0
            torque = gear * twist + damping * slide
            drive = stiffness * (goal - angle) + offset
            if drive > most:
                drive = most
            elif drive < -most:
                drive = -most
            rate = (rate + gain * (drive - torque)) * loss
            if rate > stick:  # dry friction takes what speed it can, and no more
                rate -= stick
            elif rate < -stick:
                rate += stick
            else:
                rate = 0.0
            torques.append(torque)
            angles.append(angle + step * rate)
            rates.append(rate)
        self._angle, self._rate = angles, rates
        return torques

    def _offsets(self, command: Sequence[float]) -> Sequence[float]:
        """Return what the position loop drives with beside its stiffness, N m."""
        if not self._pid:
            return _NONE
        wanted = self._ki * self._step
        self._integral = [
            min(max(integral + wanted * (goal - angle), -STALL_TORQUE), STALL_TORQUE)
            for integral, goal, angle in zip(self._integral, command, self._angle, strict=True)
        ]
        before, self._command = self._command, command
        return [
            integral + self._kd * ((goal - last) / self._step - rate)
            for integral, goal, last, rate in zip(
                self._integral, command, before, self._rate, strict=True
            )
        ]


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
