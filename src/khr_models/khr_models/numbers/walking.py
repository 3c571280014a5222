"""The numbers of the models' document about walking: servo loop, identification, harmonics."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from khr_common.markdown import table, table_of
from khr_common.published import GAIT_FREQUENCY, GAIT_PERIOD
from khr_models.checks import FORMS
from khr_models.harmonics import integrated_harmonics, published_harmonics, series_harmonics
from khr_models.pendulum import Pendulum
from khr_models.servo.gain_unit import LoopSolution, solve_for_unit, solve_loop
from khr_models.servo.servo_loop import (
    ServoLoop,
    Tone,
    gain_of_board,
    response_by_residues,
    response_by_simulation,
    response_published,
    ringing_frequency,
)
from khr_models.servo.stiffness import sweep_stiffness
from khr_models.thesis import ANKLE_LOOP, HIP_LOOP, identified_servo, loop_gain

ROBOT = Pendulum()
SWING = math.radians(3.0)  # rad, pitch at f_0


def servo_loop_numbers() -> str:
    """Return how the forms of the servo loop (5.1)-(5.14) compare."""
    loop = identified_servo().loop(gain_of_board(15.0))
    printed = replace(loop, gain=loop_gain(15.0, 'published'), form='published')
    tone, time = Tone(SWING, GAIT_FREQUENCY), np.linspace(0.0, GAIT_PERIOD, 1001)
    residues = response_by_residues(loop, [tone], time)
    others = [
        np.max(np.abs(other - residues))
        for other in (
            response_by_simulation(loop, [tone], time),
            response_published(loop, tone, time),
        )
    ]
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
        for part, ringing, ratio, rate, limit in zip(
            share,
            sweep.ringing_frequency,
            sweep.damping_ratio,
            sweep.ringing_rate,
            sweep.stability_limit,
            strict=True,
        )
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
