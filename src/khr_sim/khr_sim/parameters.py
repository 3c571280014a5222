"""Parameters of the simulation: ground, physics, servos and initial errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from khr_common import ParameterError, fixed, parameter
from khr_common.published import CONTROL_PERIODS


def _friction(default: float, materials: str) -> Any:
    return parameter(default, f'Friction coefficient of {materials}.', '[0, 2]')


def _scale(default: float, joints: str, gain: str) -> Any:
    return parameter(
        default,
        f'{gain.capitalize()} gain of the {joints} servos relative to the identified loop.',
        '[0.1, 5]',
    )


@dataclass(frozen=True)
class SimulatorParameters:
    """The parameter table of the simulator.

    Raises:
        ParameterError: if the board does not have the control period, if it is no multiple of
            the physics step, or if the contact time is below two of these steps.
    """

    inclination_deg: float = parameter(
        0.0, 'Inclination of the ground; positive if the robot faces downhill.', '[-30, 30] deg'
    )
    inclination_rate_deg_s: float = parameter(
        0.0, 'Speed at which the inclination grows during the run.', '[-5, 5] deg/s'
    )
    level_start: bool = fixed(
        False, 'Start on level ground, which then tilts to the inclination at 2 deg/s.'
    )
    surface: str = fixed(
        'smooth',
        'Contact surface: bare soles on the smooth slope, rubber soles, or the pads of the '
        'force sensors.',
        choices=('smooth', 'rubber', 'pads'),
    )
    friction: float = parameter(
        0.0, 'Friction coefficient of feet and ground; 0 takes the value of the surface.', '[0, 2]'
    )
    friction_smooth: float = _friction(0.2485, 'the bare sole on the smooth slope')
    friction_rubber: float = _friction(0.2849, 'the rubber sole on the slope')
    friction_pads: float = _friction(0.8, 'the force-sensor pads on the slope')
    pad_distance: float = fixed(
        0.02669, 'Distance of toe pad and heel pad from the ankle axis.', '[0.005, 0.05] m'
    )
    engine: str = fixed(
        'bullet',
        'Physics engine: "bullet" is PyBullet; "mujoco" is MuJoCo, an extra of this package.',
        choices=('bullet', 'mujoco'),
    )
    physics_step: float = fixed(0.001, 'Time step of the physics.', '[0.0001, 0.001] s')
    solver_iterations: int = fixed(
        50, 'Iterations of the contact solver per physics step.', '[5, 1000]'
    )
    solver_tolerance: float = fixed(
        1e-6,
        'Convergence tolerance of the contact solver, as improvement of its cost (mujoco only).',
        '[0, 0.01]',
    )
    contact_time: float = fixed(
        0.004,
        'Time constant of the contact compliance, at least two physics steps (mujoco only).',
        '[0.0002, 0.05] s',
    )
    friction_cone: str = fixed(
        'elliptic',
        'Friction cone: exact, or the inscribed pyramid (mujoco only).',
        choices=('elliptic', 'pyramid'),
    )
    control_period: float = fixed(
        0.015,
        'Output period of the controller board: 0.010, 0.015, 0.020 or 0.025.',
        '[0.01, 0.025] s',
    )
    gui: bool = fixed(False, 'Show the window of the physics engine.')
    servo_model: str = fixed(
        'pid',
        'Position loop of the servos: stiffness set by "stretch", or the identified PID loop.',
        choices=('stretch', 'pid'),
    )
    stiffness_per_stretch: float = parameter(
        0.252, 'Stiffness of a servo per unit of its stretch setting.', '[0.01, 2] N m/rad'
    )
    stretch_upper: int = parameter(60, 'Stretch of head and arm servos.', '[1, 127]')
    stretch_hip: int = parameter(60, 'Stretch of the hip servos, roll and pitch.', '[1, 127]')
    stretch_knee: int = parameter(75, 'Stretch of the knee servos.', '[1, 127]')
    stretch_ankle_pitch: int = parameter(45, 'Stretch of the ankle-pitch servos.', '[1, 127]')
    stretch_ankle_roll: int = parameter(30, 'Stretch of the ankle-roll servos.', '[1, 127]')
    derivative_time: float = parameter(
        0.0,
        'Derivative gain over the stiffness set by "stretch"; 2/69 s = 0.029 s in the identified '
        'loop.',
        '[0, 0.1] s',
    )
    pid_kp: float = parameter(
        69.0,
        'Proportional gain of the identified servo loop: armature volts per volt of '
        'potentiometer error.',
        '[1, 1000]',
    )
    pid_ki: float = parameter(40.0, 'Integral gain of the identified servo loop.', '[0, 1000] 1/s')
    pid_kd: float = parameter(2.0, 'Derivative gain of the identified servo loop.', '[0, 10] s')
    pid_scale_hip: float = _scale(0.7123, 'hip', 'proportional')
    pid_scale_knee: float = _scale(2.378, 'knee', 'proportional')
    pid_scale_ankle: float = _scale(2.247, 'ankle', 'proportional')
    pid_kd_scale_hip: float = _scale(0.9001, 'hip', 'derivative')
    pid_kd_scale_knee: float = _scale(1.0, 'knee', 'derivative')
    pid_kd_scale_ankle: float = _scale(0.9285, 'ankle', 'derivative')
    rotor_inertia: float = parameter(
        0.004,
        'Inertia of rotor and gears of a servo, reflected to the output shaft.',
        '[0.0005, 0.02] kg m^2',
    )
    gear_stiffness: float = parameter(
        22.24,
        'Stiffness between potentiometer and link of a servo: shaft, horn, bracket.',
        '[1, 200] N m/rad',
    )
    gear_stiffness_ankle: float = parameter(
        13.3,
        'Gear stiffness of the ankle servos, pitch and roll; 0 takes the value of all servos.',
        '[0, 200] N m/rad',
    )
    gear_damping: float = parameter(
        0.02, 'Damping parallel to the gear stiffness.', '[0, 0.025] N m s/rad'
    )
    servo_friction: float = parameter(
        0.03059, 'Dry friction of motor and gears of a servo, at the output shaft.', '[0, 0.5] N m'
    )
    backlash_deg: float = parameter(
        0.197, 'Total free play of the gears of a servo, at the output shaft.', '[0, 3] deg'
    )
    seed: int = fixed(0, 'Seed of the initial error.', '[0, inf]')
    initial_tilt_deg: float = fixed(
        0.0,
        'Standard deviation of the initial error in pitch and roll of the robot.',
        '[0, 5] deg',
    )
    zero_error_deg: float = fixed(
        0.0,
        'Standard deviation of the zero errors of the servos, drawn once per seed.',
        '[0, 2] deg',
    )
    stop_when_tilted_deg: float = parameter(
        60.0, 'Tilt of the torso that ends a run.', '[10, 180] deg'
    )

    def __post_init__(self) -> None:
        if self.control_period not in CONTROL_PERIODS:
            raise ParameterError.refused(
                'control_period', self.control_period, f'{" | ".join(map(str, CONTROL_PERIODS))} s'
            )
        if self.steps * round(self.physics_step * 1e9) != round(self.control_period * 1e9):
            raise ParameterError.refused(
                'physics_step',
                self.physics_step,
                'whole nanoseconds, a whole fraction of the control period, '
                f'{self.control_period} s',
            )
        if self.contact_time < 2.0 * self.physics_step:  # MuJoCo would clamp it silently
            raise ParameterError(
                f'contact_time: {self.contact_time:g} is not accepted; accepted: at least two '
                f'physics steps, {2.0 * self.physics_step:g} s'
            )

    @property
    def steps(self) -> int:
        """Count the physics steps per control period."""
        return round(self.control_period / self.physics_step)

    @property
    def sole_friction(self) -> float:
        """Return the friction coefficient between the feet and the ground."""
        of_surface: float = getattr(self, f'friction_{self.surface}')
        return self.friction or of_surface
