"""The numbers of the models' document about standing: pendulum, ankle servo, friction, pushes."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np

from khr_common.markdown import table, table_of
from khr_common.published import STALL_TORQUE
from khr_models.checks import FORMS
from khr_models.pendulum import GRAVITY, Pendulum, critical_inclination, simulate
from khr_models.servo.servo_loop import gain_of_board
from khr_models.standing.ankle_servo import (
    Pid,
    controlled_critical_inclination,
    controlled_lean,
    corrected_motion,
    largest_rate,
)
from khr_models.standing.friction import SlidingFoot, simulate_sliding, sliding_inclination
from khr_models.standing.push import Direction, largest_push
from khr_models.standing.tipping import PushLoop, tipping_force
from khr_models.thesis import FORCE_GAIN, INITIAL_LEAN

ROBOT = Pendulum()


def pendulum_numbers() -> str:
    """Return critical inclinations and motions of the pendulum (3.1)-(3.10)."""
    rows = []
    for lean in (-2.0, 0.0, 0.05, 2.0):
        critical = [
            math.degrees(critical_inclination(ROBOT, math.radians(lean), form))
            for form in ('published', 'exact', 'tangent')
        ]
        rows.append([f'{lean:g}', *(f'{one:.3f}' for one in critical)])
    swing = simulate(ROBOT, initial_lean=0.01, inclination=0.1, form='published')
    fall = simulate(ROBOT, initial_lean=0.01, inclination=0.1)
    middle = math.degrees(0.5 * (swing.lean.max() + swing.lean.min()))
    head = ['th_A0, deg', '(3.10) published, deg', 'exact, deg', 'tangent, deg']
    return (
        f'{table(head, rows)}\n\n'
        f'(3.6) let go at {math.degrees(0.01):.2f} deg on an incline of {math.degrees(0.1):.2f} '
        f'deg: published, it swings about {middle:.2f} deg for ever; physical, it lies on the '
        f'surface after {fall.time[-1]:.2f} s.'
    )


def ankle_numbers() -> str:
    """Return the limits of the ankle servo and the force loop (3.11)-(3.13)."""
    phi = math.radians(6.0)
    motion = partial(
        corrected_motion, ROBOT, FORCE_GAIN, inclination=phi, initial_lean=INITIAL_LEAN
    )
    lean = partial(controlled_lean, ROBOT, FORCE_GAIN, inclination=phi, initial_lean=INITIAL_LEAN)
    rates = [abs(math.degrees(largest_rate(motion(form=form)))) for form in FORMS]
    target, wrong = lean(), lean(form='published')
    free, held = (
        math.degrees(controlled_critical_inclination(ROBOT, gain, initial_lean=INITIAL_LEAN))
        for gain in (0.0, FORCE_GAIN)
    )
    return '\n'.join(
        [
            f'- The one calibrated constant: K_A = 12 is {1e3 * FORCE_GAIN:.3f} mrad/N, so that '
            f'phi_cr rises from {free:.2f} to {held:.2f} deg.',
            f'- At 6 deg the loop (3.13) leans the robot to {math.degrees(target):.2f} deg '
            f'(physical, against the load) or to {math.degrees(wrong):+.2f} deg (the printed sign).',
            f'- That adjustment through (3.11) has a largest pitch rate of {rates[0]:.1f} deg/s '
            f'published, {rates[1]:.1f} deg/s physical.',
            f"- K_P = 69, read in N m/rad, reaches the real servo's stall torque of "
            f'{STALL_TORQUE:g} N m at an error of {math.degrees(STALL_TORQUE / 69.0):.2f} deg.',
        ]
    )


def friction_numbers() -> str:
    """Return whether the foot slides or the robot tips first, by friction."""
    rows = []
    tips = math.degrees(critical_inclination(ROBOT, INITIAL_LEAN, 'tangent'))
    for friction in (0.05, 0.10, 0.18, 0.60):
        foot = SlidingFoot(friction=friction)
        slides = math.degrees(sliding_inclination(friction))
        inclination = math.radians(slides + 2.0)
        motion = simulate_sliding(ROBOT, foot, Pid(), inclination=inclination, duration=2.0)
        change = np.diff(motion.slide_rate)[-1] / np.diff(motion.time)[-1]
        block = GRAVITY * (math.sin(inclination) - friction * math.cos(inclination))
        rows.append(
            {
                'mu': f'{friction:.2f}',
                'atan(mu), deg': f'{slides:.2f}',
                'which comes first': 'slides' if slides < tips else 'tips',
                'slide 2 deg beyond, simulated, m/s^2': f'{change:.3f}',
                'a block, m/s^2': f'{block:.3f}',
            }
        )
    return table_of(rows)


def push_numbers() -> str:
    """Return the largest pushes that are survived (4.1)-(4.7)."""
    downhill = math.radians(2.0)
    cases: list[tuple[str, PushLoop, Direction]] = [
        ('published, flat', PushLoop(form='published'), 'behind'),
        ('physical, flat', PushLoop(), 'behind'),
        ('physical, flat, K_I = 0', PushLoop(pid=Pid(integral=0.0)), 'behind'),
        ('physical, 2 deg, behind', PushLoop(inclination=downhill), 'behind'),
        ('physical, 2 deg, front', PushLoop(inclination=downhill), 'front'),
        (
            'physical, 2 deg, front, K_I = 0',
            PushLoop(inclination=downhill, pid=Pid(integral=0.0)),
            'front',
        ),
    ]
    rows = [
        [name, *(f'{_survived(loop, setting, side):.2f}' for setting in (0.0, 12.0, 18.0))]
        for name, loop, side in cases
    ]
    head = ['form, inclination, direction', 'K_A = 0', 'K_A = 12', 'K_A = 18']
    return (
        f'A lasting push lifts the heel from m g b/l = {tipping_force(ROBOT):.2f} N. The largest '
        'push of 0.1 s survived, N, with an ideal gyro read every 15 ms:\n\n'
        f'{table(head, rows)}'
    )


def _survived(loop: PushLoop, setting: float, side: Direction) -> float:
    return largest_push(
        replace(loop, gain=gain_of_board(setting)), duration=0.1, direction=side, watch=2.0
    )
