"""Write the numbers of the models' document: its name is the command line's one argument."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache, partial

import numpy as np

from khr_common.markdown import WrittenPart, table, table_of
from khr_common.published import GAIT_FREQUENCY, GAIT_PERIOD, STALL_TORQUE
from khr_models.checks import FORMS
from khr_models.harmonics import integrated_harmonics, published_harmonics, series_harmonics
from khr_models.pendulum import GRAVITY, Pendulum, critical_inclination, simulate
from khr_models.servo.identification import LoopSolution, solve_for_unit, solve_loop
from khr_models.servo.servo_loop import (
    ServoLoop,
    Tone,
    gain_of_board,
    response_by_residues,
    response_by_simulation,
    response_published,
    ringing_frequency,
    sweep_stiffness,
)
from khr_models.standing.ankle_servo import (
    Pid,
    controlled_critical_inclination,
    controlled_lean,
    corrected_motion,
    largest_rate,
)
from khr_models.standing.friction import SlidingFoot, simulate_sliding, sliding_inclination
from khr_models.standing.push import Direction, PushLoop, largest_push, tipping_force
from khr_models.thesis import (
    ANKLE_LOOP,
    FORCE_GAIN,
    HIP_LOOP,
    INITIAL_LEAN,
    identified_servo,
    loop_gain,
)

ROBOT = Pendulum()
SWING = math.radians(3.0)  # rad, pitch at f_0


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
            '- The adjustment to the first of these leans through (3.11), from a servo that carries the '
            f'weight, has a largest pitch rate of {rates[0]:.1f} deg/s published, {rates[1]:.1f} deg/s '
            'physical.',
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


def servo_loop_numbers() -> str:
    """Return how the forms of the servo loop (5.1)-(5.14) compare."""
    loop = identified_servo().loop(gain_of_board(15.0))
    printed = replace(loop, gain=loop_gain(15.0, 'published'), form='published')
    tone, time = Tone(SWING, GAIT_FREQUENCY), np.linspace(0.0, GAIT_PERIOD, 1001)
    residues = response_by_residues(loop, [tone], time)
    integrated = response_by_simulation(loop, [tone], time)
    closed = response_published(loop, tone, time)
    others = [np.max(np.abs(other - residues)) for other in (integrated, closed)]
    light = (0.1414, 2.0, 151.0)
    pair = [ringing_frequency(*light, form) for form in ('published', 'physical')]
    light_loop = ServoLoop(*light, form='published')
    a0 = [replace(light_loop, form=form).tone_amplitude(tone) for form in FORMS]
    b0 = [
        replace(light_loop, form=form).ring_amplitude(math.radians(1.0), 0.0, GAIT_FREQUENCY)
        for form in FORMS
    ]
    return '\n'.join(
        [
            f'- The identified servo at K_A = 15: B_f = {loop.feedback_damping:.2f} N m s/rad; the '
            f'printed (5.4), without K, gives {printed.feedback_damping:.2f}.',
            f'- (5.12) at J = {light[0]:g}, B_f = {light[1]:g}, K = {light[2]:g}: printed '
            f'{pair[0]:.2f}, exact {pair[1]:.2f} Hz.',
            f'- (5.13) there for 3 deg at f_0: printed {math.degrees(a0[0]):.4f} deg, '
            f'exact {math.degrees(a0[1]):.3f} deg (the numerator K is missing).',
            f'- (5.14) there from 1 deg at rest: printed {math.degrees(b0[0]):.2f} deg (its second term is '
            f'not squared, and its frequency is that of the gait), exact {math.degrees(b0[1]):.3f} deg.',
            '- (5.11) by residues against integration, and against its closed form with exact terms: '
            f'largest difference below {max(1e-9, float(others[0])):.0e} and '
            f'{max(1e-12, float(others[1])):.0e} rad.',
        ]
    )


def identification_numbers() -> str:
    """Return the servo as two measured peaks identify it."""
    rows = []
    for form in FORMS:
        servo = identified_servo(form)
        third = servo.predict(loop_gain(15.0, form))
        rows.append(
            [
                form,
                f'{servo.stiffness:.1f} +- {servo.stiffness_deviation:.1f}',
                f'{servo.damping:.2f} +- {servo.damping_deviation:.2f}',
                f'{third.frequency:.2f} +- {third.deviation:.2f}',
                f'{third.low:.2f} to {third.high:.2f}',
            ]
        )
    servo = identified_servo()
    loop = servo.loop(0.0)
    limit = loop.stability_limit / gain_of_board(1.0)
    head = ['form', 'K/J, 1/s^2', 'B/J, 1/s', 'f_A0 at K_A = 15, Hz', '95 %']
    return (
        'From f_A0 = 2.58 Hz at K_A = 12 and 4.74 Hz at 18, each +-0.22 Hz:\n\n'
        f'{table(head, rows)}\n\n'
        f'Physical: K = {loop.stiffness:.0f} N m/rad for J = m l^2; without gyro the damping '
        f'ratio is {loop.damping_ratio:.2f} (no ringing); the loop is unstable from '
        f'K_A = {limit:.1f}. 2.58 Hz lies within {abs(2.58 - 6 / GAIT_PERIOD):.2f} Hz of line 6 '
        f'of the gait cycle, 4.74 Hz within {abs(4.74 - 11 / GAIT_PERIOD):.2f} Hz of line 11.'
    )


def gain_unit_numbers() -> str:
    """Return the solutions of both loops with a free gain unit."""
    loops = {'ankle': ANKLE_LOOP, 'hip': HIP_LOOP}
    rows = [
        [name, *_solution_cells(solve_loop(published, frequency))]
        for (name, published), frequencies in zip(
            loops.items(), ((4.8, 4.9, 5.0, 5.2), (8.42, 8.5, 8.6, 8.8)), strict=True
        )
        for frequency in frequencies
    ]
    shared = [
        [f'{unit:.1f}', *(_shared_cell(solve_for_unit(loops[n], unit)) for n in loops)]
        for unit in (1.0, 1.2, 1.4, 1.6)
    ]
    head = ['loop', 'f_n, Hz', 'zeta without feedback', 'critical K', 'B/K, s', 'gain unit']
    return (
        'Pairs of gain and frequency: K_A 12 and 18 at 2.58 and 4.74 Hz; K_H 12 and 14 at 7.33 '
        '(on rubber) and 8.40 Hz. The gain unit is a multiple of 0.00463 s at K = 1. Each row has '
        'both frequencies of its loop:\n\n'
        f'{table(head, rows)}\n\n'
        'One unit for both loops:\n\n'
        f'{table(["gain unit", "ankle: f_n, critical K_A", "hip: f_n, critical K_H"], shared)}'
    )


def _solution_cells(loop: LoopSolution) -> list[str]:
    return [
        f'{loop.natural_frequency:.2f}',
        f'{loop.damping_ratio:.2f}',
        f'{loop.critical_gain:.1f}',
        f'{loop.damping_time:.3f}',
        f'{loop.gain_unit:.2f}',
    ]


def _shared_cell(loop: LoopSolution) -> str:
    return f'{loop.natural_frequency:.2f} Hz, {loop.critical_gain:.1f}'


def stiffness_numbers() -> str:
    """Return how the joint's stiffness acts on vibration."""
    loop = identified_servo().loop(gain_of_board(12.0))
    share = np.array([0.5, 0.75, 1.0, 1.5, 2.0])
    sweep = sweep_stiffness(loop, share * loop.stiffness, Tone(SWING, GAIT_FREQUENCY))
    rows = [
        {
            'K over the identified': f'{part:g}',
            'f_A0 at K_A = 12, Hz': f'{ringing:.2f}',
            'damping ratio': f'{ratio:.2f}',
            'ringing rate, deg/s rms': (
                f'{math.degrees(rate):.1f}' if math.isfinite(rate) else 'unstable'
            ),
            'largest K_A': f'{limit / gain_of_board(1.0):.1f}',
        }
        for part, ringing, ratio, rate, limit in zip(share, *vars(sweep).values(), strict=True)
    ]
    return table_of(rows)


def harmonics_numbers() -> str:
    """Return the harmonics of a swing, printed, by series and by integration (5.15)-(5.20)."""
    rows = []
    for degrees in (0.0, 3.0, 5.55, 8.88):
        inclination = math.radians(degrees)
        second, third = published_harmonics(ROBOT, SWING, inclination)
        series = series_harmonics(ROBOT, SWING, inclination)
        whole = integrated_harmonics(ROBOT, SWING, inclination)
        rows.append(
            {
                'phi, deg': f'{degrees:g}',
                'a_2/a_0 printed, 1/s^2': f'{second / SWING:.3f}',
                'a_1/a_0 printed, 1/s^2': f'{third / SWING:.3f}',
                '2 f_0 series': _size(series.second),
                '2 f_0 integrated': _size(whole.second),
                '3 f_0 series': _size(series.third),
                '3 f_0 integrated': _size(whole.third),
            }
        )
    text = 'A pitch of 3 deg at f_0, amplitudes over that of f_0:'
    return f'{text}\n\n{table_of(rows)}'


def _size(amplitude: float) -> str:
    """Write the size of a harmonic over that of f_0."""
    return f'{abs(amplitude) / SWING:.2e}' if abs(amplitude) > 1e-10 else '0'


PARTS = {
    'The pendulum (3.1)-(3.10)': pendulum_numbers,
    'The ankle servo and the force loop (3.11)-(3.13)': ankle_numbers,
    'Friction': friction_numbers,
    'The servo loop (5.1)-(5.14)': servo_loop_numbers,
    'Identification': identification_numbers,
    'Gain unit of both gyro loops': gain_unit_numbers,
    'Joint stiffness': stiffness_numbers,
    'Harmonics (5.15)-(5.20)': harmonics_numbers,
    'Push recovery (4.1)-(4.7)': push_numbers,
}


@cache
def tables() -> str:
    """Return the numbers of the document as Markdown."""
    return '\n\n'.join(f'### {title}\n\n{numbers()}' for title, numbers in PARTS.items())


PART = WrittenPart('khr_models.report docs/models.md', tables)

if __name__ == '__main__':
    PART.main()
