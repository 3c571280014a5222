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

from khr_sim.compiled import compiled
from khr_sim.parameters import SimulatorParameters
from khr_sim.robot import JOINTS

Array = NDArray[np.float64]

STALL_TORQUE = 1.373  # N m at 11.1 V (maker)
NO_LOAD_SPEED = 7.48  # rad/s at 11.1 V (maker)
BACK_EMF = STALL_TORQUE / NO_LOAD_SPEED  # N m s/rad, the slope of the torque-speed line
SUPPLY = 11.1  # V
POTENTIOMETER = 5.0 / radians(270.0)  # V/rad: 5 V over the servo's range (assumed)
# A step h resolves a spring k and a damper d on an inertia I while k h^2 <= I and d h <= I / 2 (a
# symplectic step is stable while k h^2 + 2 d h < 4 I). What exceeds it is reduced to it: at the
# defaults spring and damper of the head, which carries next to nothing, and no others.
SPRING_LIMIT, DAMPER_LIMIT = 1.0, 0.5
ANGLE, RATE, INTEGRAL, COMMAND = range(4)  # rows of the state


def law(
    command: Array,
    position: Array,
    velocity: Array,
    state: Array,
    setting: Array,
    constants: Array,
    torque: Array,
) -> None:
    """Advance the rotors by one step, in plain Python: ``step`` is the same, compiled.

    Args:
        command: angles commanded by the board, rad, (n,).
        position: joint angles, rad, (n,).
        velocity: joint speeds, rad/s, (n,).
        state: of the servos, changed in place: rotor angles in rad, rotor speeds in rad/s,
            integrals of the PID loop in N m, last commands in rad, (4, n).
        setting: stiffness and gear stiffness in N m/rad, gear damping in N m s/rad, (3, n).
        constants: those of :meth:`Servos.configure`, (9,).
        torque: on the joints, set here, N m, (n,).
    """
    h, gain, loss, stick, play, is_pid, integral_gain, derivative_gain, most = constants
    for i in range(len(command)):
        goal, angle, rate = command[i], state[ANGLE, i], state[RATE, i]
        offset = 0.0
        if is_pid:
            integral = state[INTEGRAL, i] + integral_gain * h * (goal - angle)
            integral = min(max(integral, -most), most)
            offset = integral + derivative_gain * ((goal - state[COMMAND, i]) / h - rate)
            state[INTEGRAL, i], state[COMMAND, i] = integral, goal
        twist, slide = angle - position[i], rate - velocity[i]
        if play:
            twist -= min(max(twist, -play), play)
            if twist == 0.0:
                slide = 0.0
        load = setting[1, i] * twist + setting[2, i] * slide
        drive = min(max(setting[0, i] * (goal - angle) + offset, -most), most)
        rate = (rate + gain * (drive - load)) * loss
        if rate > stick:  # dry friction takes what speed it can, and no more
            rate -= stick
        elif rate < -stick:
            rate += stick
        else:
            rate = 0.0
        torque[i] = load
        state[ANGLE, i], state[RATE, i] = angle + h * rate, rate


class Servos:
    """All servos at once: command and joint state in, torque on the joints out.

    Args:
        parameters: the simulator's parameters.
        carried: what each joint carries outward, kg m^2, shape (17,).
    """

    def __init__(self, parameters: SimulatorParameters, carried: Array) -> None:
        self._carried = carried
        self._law = compiled(law)
        self.state = np.zeros((4, len(JOINTS)))  # as the law has them
        self.torque = np.zeros(len(JOINTS))
        self.configure(parameters)
        at_rest = np.zeros(len(JOINTS))
        self.update(at_rest, at_rest, at_rest)  # compiles the law, or the first period would

    def configure(self, parameters: SimulatorParameters) -> None:
        """Take changed parameters without losing the state."""
        p, h = parameters, parameters.physics_step
        gear = np.minimum(p.gear_stiffness, SPRING_LIMIT * self._carried / h**2)
        damping = np.minimum(p.gear_damping, DAMPER_LIMIT * self._carried / h)
        stiffness = p.stiffness_per_stretch * stretches(p)
        self._is_pid = p.servo_model == 'pid'
        # (3.11): the identified gains relate armature volts to volts of potentiometer error.
        kp, ki, kd = (
            gain * POTENTIOMETER * STALL_TORQUE / SUPPLY for gain in (p.pid_kp, p.pid_ki, p.pid_kd)
        )
        self._integrates = self._is_pid and ki > 0.0
        if self._is_pid:
            stiffness = np.full(len(JOINTS), kp)
        self.setting = np.array((stiffness, gear, damping))
        gain = h / p.rotor_inertia  # speed gained per N m and step
        loss = 1.0 / (1.0 + gain * BACK_EMF)  # back-EMF, implicit
        stick = gain * p.servo_friction * loss
        play = radians(p.backlash_deg) / 2.0
        self.constants = np.array(
            (h, gain, loss, stick, play, self._is_pid, ki, kd, STALL_TORQUE), dtype=float
        )

    def reset(self, command: Array, torque: Array) -> Array:
        """Stand still under a load.

        Args:
            command: angles commanded by the board, rad, shape (17,).
            torque: what each servo has to hold, N m, shape (17,).

        Returns:
            The joint angles (17,) in rad at which the servos hold it.
        """
        stiffness, gear, _ = self.setting
        held = np.clip(torque, -STALL_TORQUE, STALL_TORQUE)
        integral = held if self._integrates else np.zeros(len(JOINTS))
        angle = command - (held - integral) / stiffness
        self.state[:] = angle, 0.0 * angle, integral, command
        return np.asarray(angle - held / gear)

    def update(self, command: Array, position: Array, velocity: Array) -> Array:
        """Advance one physics step and return the torques on the joints.

        Args:
            command: angles commanded by the board, rad, (17,).
            position: joint angles, rad, (17,).
            velocity: joint speeds, rad/s, (17,).

        Returns:
            The torques (17,) in N m to apply to the joints during the step; the next step
            overwrites them.
        """
        self._law(
            command, position, velocity, self.state, self.setting, self.constants, self.torque
        )
        return self.torque


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
