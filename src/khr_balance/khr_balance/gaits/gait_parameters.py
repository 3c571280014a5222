"""The parameters of the gait: the slow walk in the maker's published figures."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common import parameter
from khr_common.published import GAIT_PERIOD


@dataclass(frozen=True)
class GaitParameters:
    """What the robot plays back; lengths are in the plane that it stands on.

    The maker's slow walk has these figures: timing, stride 56 mm, lift 18 to 22 mm, centre of
    mass 17 to 25 mm inboard of the stance sole's centre, 11 to 15 mm ahead of it in single support
    and 24 to 31 mm at touchdown, hips 118 mm above the ankles, torso pitched -2 to 7 deg.
    The paths between them are ours. Fitted, together with constants of servos, ground and
    controllers (docs/calibration.md): the places of the centre of mass, in the walk within the
    maker's range. Assumed:
    ``heel_off`` and the arms; the hips are 3 mm lower, or the rear leg is too short.
    """

    motion: str = parameter('walk', 'What to do.', choices=('stand', 'walk', 'leg_lift'))
    start_delay: float = parameter(
        1.0, 'Stance before the motion starts.', unit='s', minimum=0.0, maximum=60.0
    )
    end_pause: float = parameter(
        1.0, 'Stance after the motion has ended.', unit='s', minimum=0.0, maximum=600.0
    )

    hip_height: float = parameter(
        0.115,
        'Hip-pitch axes above the ankle-pitch axes of flat feet.',
        unit='m',
        minimum=0.06,
        maximum=0.13,
    )
    torso_pitch: float = parameter(
        0.1, 'Forward lean of the torso.', unit='rad', minimum=-0.3, maximum=0.5
    )
    foot_spread: float = parameter(
        0.084,
        'Distance between the centre lines of the soles.',
        unit='m',
        minimum=0.08,
        maximum=0.14,
    )
    shoulder_pitch: float = parameter(
        0.0, "Both shoulders' pitch.", unit='rad', minimum=-3.14, maximum=1.57
    )
    shoulder_roll: float = parameter(
        0.2, 'Spread of both arms.', unit='rad', minimum=0.0, maximum=3.14
    )
    elbow_pitch: float = parameter(
        -0.4, "Both elbows' pitch.", unit='rad', minimum=-2.26, maximum=0.52
    )

    com_stance: float = parameter(
        -0.008499,
        "Centre of mass ahead of the soles' centres in the stance.",
        unit='m',
        minimum=-0.05,
        maximum=0.05,
    )
    walk_start_shift: float = parameter(
        0.0,
        'Walk: centre of mass in the first and last stance, ahead of ``com_stance``.',
        unit='m',
        minimum=-0.03,
        maximum=0.03,
    )
    first_step_shift: float = parameter(
        0.0,
        'Walk: centre of mass in the first step when the foot is fully lifted, ahead of '
        '``com_lifted``.',
        unit='m',
        minimum=-0.03,
        maximum=0.03,
    )
    com_lifted: float = parameter(
        0.01167,
        "Walk: centre of mass ahead of the stance sole's centre when the other foot is "
        'fully lifted.',
        unit='m',
        minimum=-0.05,
        maximum=0.05,
    )
    com_touchdown: float = parameter(
        0.0296,
        "Walk: centre of mass ahead of the stance sole's centre when the other foot touches down.",
        unit='m',
        minimum=-0.05,
        maximum=0.08,
    )
    sway: float = parameter(
        0.025,
        'Walk: largest sideways distance of the centre of mass from the midline.',
        unit='m',
        minimum=0.0,
        maximum=0.06,
    )
    stride: float = parameter(
        0.056,
        'Walk: largest fore-aft distance between the feet.',
        unit='m',
        minimum=0.0,
        maximum=0.1,
    )
    lift: float = parameter(
        0.020,
        'Height to which a swinging or lifted foot rises.',
        unit='m',
        minimum=0.0,
        maximum=0.05,
    )
    heel_off: float = parameter(
        0.25,
        'Walk: how far the rear foot tips on its toe before it lifts off; a flat one would '
        'stretch the leg beyond its length.',
        unit='rad',
        minimum=0.0,
        maximum=0.6,
    )
    cycle_period: float = parameter(
        GAIT_PERIOD,
        "Walk: two steps. The maker's slow walk takes 154 frames of 15 ms.",
        unit='s',
        minimum=0.4,
        maximum=20.0,
    )
    cycles: int = parameter(
        4,
        'Walk: whole cycles between the half cycle that starts and the one that ends.',
        minimum=0,
        maximum=1000,
    )
    phases: tuple[float, ...] = parameter(
        (20.0, 12.0, 8.0, 17.0, 20.0),
        "Walk: relative lengths of a step's phases: shift the weight, lift the foot, swing it, "
        'lower it, move on to both feet.',
        minimum=0.5,
        maximum=1000.0,
        length=5,
    )
    first_foot: str = parameter(
        'right', 'The foot that swings first, or is lifted.', choices=('left', 'right')
    )

    lift_com_inboard: float = parameter(
        0.0,
        "Leg lift: centre of mass inboard of the stance sole's centre.",
        unit='m',
        minimum=-0.03,
        maximum=0.042,
    )
    lift_torso_roll: float = parameter(
        0.1,
        'Leg lift: lean of the torso towards the stance leg.',
        unit='rad',
        minimum=-0.3,
        maximum=0.5,
    )
    shift_time: float = parameter(
        2.0,
        'Leg lift: time to shift the weight over one leg, and back.',
        unit='s',
        minimum=0.2,
        maximum=60.0,
    )
    lift_time: float = parameter(
        1.0,
        'Leg lift: time to lift the other foot, and to set it down.',
        unit='s',
        minimum=0.1,
        maximum=60.0,
    )
    hold_time: float = parameter(
        3.0, 'Leg lift: time for which the foot stays up.', unit='s', minimum=0.0, maximum=600.0
    )
