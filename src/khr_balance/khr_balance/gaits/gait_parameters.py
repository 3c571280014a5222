"""The parameters of the gait: the maker's slow walk in published numbers."""

from __future__ import annotations

from dataclasses import dataclass
from math import isclose
from pathlib import Path

from khr_common import fixed, parameter
from khr_common.published import GAIT_PERIOD


@dataclass(frozen=True)
class GaitParameters:
    """The parameter table of the gait; lengths are in the plane of the stance.

    The maker's slow walk gives the timing, a stride of 56 mm, a lift of 18 to 22 mm, the centre of
    mass 17 to 25 mm inboard of the stance sole's centre, 11 to 15 mm ahead of it in single support
    and 24 to 31 mm at touchdown, the hips 118 mm above the ankles, and a torso pitch of -2 to
    7 deg. The paths between these values are our own. The positions of the centre of mass are
    fitted together with constants of servos, ground and controllers (docs/calibration.md).
    ``heel_off`` and the arms are assumed; the hips are 3 mm lower, otherwise the rear leg is too
    short.
    """

    motion: str = parameter(
        'walk', 'Motion to play back.', choices=('stand', 'guard', 'walk', 'leg_lift', 'file')
    )
    motion_file: str = fixed('', 'File: CSV or YAML file of key frames, relative to the scenario.')
    frames: str = fixed('', 'File: the key frames as CSV, read from ``motion_file``.')
    between: str = parameter(
        'rest',
        'File: joints or centre of mass rest at every key frame, or pass it smoothly.',
        choices=('rest', 'smooth'),
    )
    repeat: tuple[float, ...] = parameter(
        (0.0, 0.0),
        'File: times of the first and last frame of the part that is played ``cycles`` times; '
        'equal: no part.',
        '[0, 3600] s',
        length=2,
    )
    start_delay: float = parameter(1.0, 'Duration of the stance before the motion.', '[0, 60] s')
    end_pause: float = parameter(1.0, 'Duration of the stance after the motion.', '[0, 600] s')

    hip_height: float = parameter(
        0.115,
        'Height of the hip-pitch axes above the ankle-pitch axes of flat feet.',
        '[0.06, 0.13] m',
    )
    torso_pitch: float = parameter(0.1, 'Forward lean of the torso.', '[-0.3, 0.5] rad')
    foot_spread: float = parameter(
        0.084, 'Distance between the centre lines of the soles.', '[0.08, 0.14] m'
    )
    shoulder_pitch: float = parameter(0.0, "Both shoulders' pitch.", '[-3.14, 1.57] rad')
    shoulder_roll: float = parameter(0.2, 'Spread of both arms.', '[0, 3.14] rad')
    elbow_pitch: float = parameter(-0.4, "Both elbows' pitch.", '[-2.26, 0.52] rad')

    com_stance: float = parameter(
        -0.001904, "Centre of mass ahead of the soles' centres in the stance.", '[-0.05, 0.05] m'
    )
    walk_start_shift: float = parameter(
        0.004889,
        'Walk: shift of the centre of mass ahead of ``com_stance`` in the first and last stance.',
        '[-0.03, 0.03] m',
    )
    first_step_shift: float = parameter(
        0.0008306,
        'Walk: shift of the centre of mass ahead of ``com_lifted`` in the first step.',
        '[-0.03, 0.03] m',
    )
    com_lifted: float = parameter(
        0.004433,
        "Walk: centre of mass ahead of the stance sole's centre when the other foot is "
        'fully lifted.',
        '[-0.05, 0.05] m',
    )
    com_touchdown: float = parameter(
        0.01683,
        "Walk: centre of mass ahead of the stance sole's centre when the other foot touches down.",
        '[-0.05, 0.08] m',
    )
    sway: float = parameter(
        0.025,
        'Walk: largest sideways distance of the centre of mass from the midline.',
        '[0, 0.06] m',
    )
    stride: float = parameter(
        0.056, 'Walk: largest fore-aft distance between the feet.', '[0, 0.1] m'
    )
    lift: float = parameter(0.020, 'Height of a swinging or lifted foot.', '[0, 0.05] m')
    heel_off: float = parameter(
        0.25,
        'Walk: pitch of the rear foot on its toe before lift-off; with a flat foot the leg would be '
        'too short.',
        '[0, 0.6] rad',
    )
    cycle_period: float = parameter(
        GAIT_PERIOD,
        "Walk: duration of two steps; the maker's slow walk takes 154 frames of 15 ms.",
        '[0.4, 20] s',
    )
    cycles: int = parameter(
        4,
        'Walk: number of whole cycles between the first and the last half cycle. File: number of '
        'times that the part ``repeat`` is played.',
        '[0, 1000]',
    )
    phases: tuple[float, ...] = parameter(
        (20.0, 12.0, 8.0, 17.0, 20.0),
        "Walk: relative durations of a step's phases: weight shift, lift, swing, lowering, double "
        'support.',
        '[0.5, 1000]',
        length=5,
    )
    first_foot: str = parameter(
        'right',
        'Foot that swings first (walk), is lifted (leg lift) or is ahead (guard).',
        choices=('left', 'right'),
    )

    guard_split: float = parameter(0.08, 'Guard: distance of the front foot ahead.', '[0, 0.12] m')
    guard_height: float = parameter(
        0.095, 'Guard: height of the hip-pitch axes above the ankle-pitch axes.', '[0.06, 0.13] m'
    )
    guard_com: float = parameter(
        0.0, 'Guard: centre of mass ahead of the middle between the soles.', '[-0.05, 0.05] m'
    )

    lift_com_inboard: float = parameter(
        -0.0045,
        "Leg lift: centre of mass inboard of the stance sole's centre.",
        '[-0.03, 0.042] m',
    )
    lift_com_ahead: float = parameter(
        -0.00013,
        "Leg lift: centre of mass ahead of the stance sole's centre while the other foot is up.",
        '[-0.03, 0.03] m',
    )
    lift_torso_roll: float = parameter(
        0.1, 'Leg lift: lean of the torso towards the stance leg.', '[-0.3, 0.5] rad'
    )
    shift_time: float = parameter(
        2.0,
        'Leg lift: duration of the weight shift over one leg, and of the shift back.',
        '[0.2, 60] s',
    )
    lift_time: float = parameter(
        1.0, 'Leg lift: duration of lifting the other foot.', '[0.1, 60] s'
    )
    lower_time: float = parameter(
        4.0,
        'Leg lift: duration of lowering the other foot; a robot near its limit that sets its foot '
        'down within 2 s tips over both feet.',
        '[0.1, 60] s',
    )
    hold_time: float = parameter(3.0, 'Leg lift: time with the foot lifted.', '[0, 600] s')

    @property
    def cyclic(self) -> bool:
        """Return whether the motion repeats a cycle of ``cycle_period``."""
        part = self.repeat[1] - self.repeat[0]
        repeats = self.motion == 'file' and isclose(part, self.cycle_period)
        return self.cycles > 0 and (self.motion == 'walk' or repeats)

    @property
    def label(self) -> str:
        """Return the name of the motion as text; that of its file if it has one."""
        return (
            Path(self.motion_file).stem if self.motion == 'file' else self.motion.replace('_', ' ')
        )
