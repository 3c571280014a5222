"""Write the numbers of the models' document: its name is the command line's one argument."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np

from khr_analysis.models.ankle_servo import (
    Pid,
    controlled_critical_inclination,
    controlled_lean,
    largest_rate,
    simulate_servo,
)
from khr_analysis.models.checks import FORMS
from khr_analysis.models.friction import SlidingFoot, simulate_sliding, sliding_inclination
from khr_analysis.models.harmonics import (
    GAIT_FREQUENCY,
    integrated_harmonics,
    published_harmonics,
    series_harmonics,
)
from khr_analysis.models.pendulum import GRAVITY, Pendulum, critical_inclination, simulate
from khr_analysis.models.push import Direction, largest_push
from khr_analysis.models.servo_loop import (
    ServoLoop,
    Tone,
    gain_of_board,
    response_by_residues,
    response_by_simulation,
    response_published,
    ringing_frequency,
)
from khr_analysis.models.stiffness import sweep_stiffness
from khr_analysis.models.thesis import (
    FORCE_GAIN,
    GAIT_PERIOD,
    INITIAL_LEAN,
    STALL_TORQUE,
    identified_servo,
    loop_gain,
)
from khr_analysis.models.tipping import PushLoop, tipping_force
from khr_common.markdown import put_between, rewrite_document, table

BEGIN = '<!-- begin: written by python -m khr_analysis.models.report docs/models.md -->'
END = '<!-- end -->'
ROBOT = Pendulum()
SWING = math.radians(3.0)  # rad, pitch at f_0


@cache
def tables() -> str:
    """Return the tables of the document as Markdown."""
    parts = [
        '### The pendulum (3.1)-(3.10)',
        _pendulum(),
        '### The ankle servo and the force loop (3.11)-(3.13)',
        _ankle(),
        '### Friction',
        _friction(),
        '### The servo loop (5.1)-(5.14)',
        _loop(),
        '### Identification',
        _identification(),
        '### Joint stiffness',
        _stiffness(),
        '### Harmonics (5.15)-(5.20)',
        _harmonics(),
        '### Push recovery (4.1)-(4.7)',
        _push(),
    ]
    return '\n\n'.join(parts)


def rewrite(text: str) -> str:
    """Replace what stands between the markers.

    Raises:
        KhrError: if a marker is missing.
    """
    return put_between(text, BEGIN, END, tables())


def _pendulum() -> str:
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
    return '\n\n'.join(
        [
            table(['th_A0, deg', '(3.10) published, deg', 'exact, deg', 'tangent, deg'], rows),
            f'(3.6) let go at {math.degrees(0.01):.2f} deg on an incline of {math.degrees(0.1):.2f} '
            f'deg: published, it swings about {middle:.2f} deg for ever; physical, it lies on the '
            f'surface after {fall.time[-1]:.2f} s.',
        ]
    )


def _ankle() -> str:
    inclination = math.radians(6.0)
    target = controlled_lean(ROBOT, FORCE_GAIN, inclination=inclination, initial_lean=INITIAL_LEAN)
    rates = [
        abs(
            math.degrees(
                largest_rate(
                    simulate_servo(
                        ROBOT,
                        Pid(),
                        target=target,
                        inclination=inclination,
                        initial_lean=INITIAL_LEAN,
                        duration=1.0,
                        form=form,
                    )
                )
            )
        )
        for form in FORMS
    ]
    wrong = controlled_lean(
        ROBOT, FORCE_GAIN, inclination=inclination, initial_lean=INITIAL_LEAN, form='published'
    )
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


def _friction() -> str:
    rows = []
    for friction in (0.05, 0.10, 0.18, 0.60):
        foot = SlidingFoot(friction=friction)
        slides = math.degrees(sliding_inclination(friction))
        inclination = math.radians(slides + 2.0)
        motion = simulate_sliding(ROBOT, foot, Pid(), inclination=inclination, duration=2.0)
        change = np.diff(motion.slide_rate)[-1] / np.diff(motion.time)[-1]
        block = GRAVITY * (math.sin(inclination) - friction * math.cos(inclination))
        tips = math.degrees(critical_inclination(ROBOT, INITIAL_LEAN, 'tangent'))
        rows.append(
            [
                f'{friction:.2f}',
                f'{slides:.2f}',
                'slides' if slides < tips else 'tips',
                f'{change:.3f}',
                f'{block:.3f}',
            ]
        )
    return table(
        [
            'mu',
            'atan(mu), deg',
            'which comes first',
            'slide 2 deg beyond, simulated, m/s^2',
            'a block, m/s^2',
        ],
        rows,
    )


def _loop() -> str:
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
    return '\n'.join(
        [
            f'- The identified servo at K_A = 15: B_f = {loop.feedback_damping:.2f} N m s/rad; the '
            f'printed (5.4), without K, gives {printed.feedback_damping:.2f}.',
            f'- (5.12) at J = {light[0]:g}, B_f = {light[1]:g}, K = {light[2]:g}: printed '
            f'{pair[0]:.2f}, exact {pair[1]:.2f} Hz.',
            f'- (5.13) there for 3 deg at f_0: printed {math.degrees(a0[0]):.4f} deg, '
            f'exact {math.degrees(a0[1]):.3f} deg (the numerator K is missing).',
            '- (5.11) by residues against integration, and against its closed form with exact terms: '
            f'largest difference below {max(1e-9, float(others[0])):.0e} and '
            f'{max(1e-12, float(others[1])):.0e} rad.',
        ]
    )


def _identification() -> str:
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
    return '\n\n'.join(
        [
            'From f_A0 = 2.58 Hz at K_A = 12 and 4.74 Hz at 18, each +-0.22 Hz:',
            table(['form', 'K/J, 1/s^2', 'B/J, 1/s', 'f_A0 at K_A = 15, Hz', '95 %'], rows),
            f'Physical: K = {loop.stiffness:.0f} N m/rad for J = m l^2; without gyro the damping '
            f'ratio is {loop.damping_ratio:.2f} (no ringing); the loop is unstable from '
            f'K_A = {limit:.1f}. 2.58 Hz lies within {abs(2.58 - 6 / GAIT_PERIOD):.2f} Hz of line 6 '
            f'of the gait cycle, 4.74 Hz within {abs(4.74 - 11 / GAIT_PERIOD):.2f} Hz of line 11.',
        ]
    )


def _stiffness() -> str:
    loop = identified_servo().loop(gain_of_board(12.0))
    share = np.array([0.5, 0.75, 1.0, 1.5, 2.0])
    sweep = sweep_stiffness(loop, share * loop.stiffness, Tone(SWING, GAIT_FREQUENCY))
    rows = [
        [
            f'{part:g}',
            f'{ringing:.2f}',
            f'{ratio:.2f}',
            f'{math.degrees(rate):.1f}' if math.isfinite(rate) else 'unstable',
            f'{limit / gain_of_board(1.0):.1f}',
        ]
        for part, ringing, ratio, rate, limit in zip(
            share,
            sweep.ringing_frequency,
            sweep.damping_ratio,
            sweep.ringing_rate,
            sweep.stability_limit,
            strict=True,
        )
    ]
    return table(
        [
            'K over the identified',
            'f_A0 at K_A = 12, Hz',
            'damping ratio',
            'ringing rate, deg/s rms',
            'largest K_A',
        ],
        rows,
    )


def _harmonics() -> str:
    rows = []
    for degrees in (0.0, 3.0, 5.55, 8.88):
        inclination = math.radians(degrees)
        second, third = published_harmonics(ROBOT, SWING, inclination)
        series = series_harmonics(ROBOT, SWING, inclination)
        whole = integrated_harmonics(ROBOT, SWING, inclination)
        rows.append(
            [
                f'{degrees:g}',
                f'{second / SWING:.3f}',
                f'{third / SWING:.3f}',
                *(
                    f'{abs(value) / SWING + 0.0:.2e}' if abs(value) > 1e-10 else '0'
                    for value in (series.second, whole.second, series.third, whole.third)
                ),
            ]
        )
    return '\n\n'.join(
        [
            'A pitch of 3 deg at f_0, amplitudes over that of f_0:',
            table(
                [
                    'phi, deg',
                    'a_2/a_0 printed, 1/s^2',
                    'a_1/a_0 printed, 1/s^2',
                    '2 f_0 series',
                    '2 f_0 integrated',
                    '3 f_0 series',
                    '3 f_0 integrated',
                ],
                rows,
            ),
        ]
    )


def _push() -> str:
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
    return '\n\n'.join(
        [
            f'A lasting push lifts the heel from m g b/l = {tipping_force(ROBOT):.2f} N. The largest '
            'push of 0.1 s survived, N, with an ideal gyro read every 15 ms:',
            table(['form, inclination, direction', 'K_A = 0', 'K_A = 12', 'K_A = 18'], rows),
        ]
    )


def _survived(loop: PushLoop, setting: float, side: Direction) -> float:
    return largest_push(
        replace(loop, gain=gain_of_board(setting)), duration=0.1, direction=side, watch=2.0
    )


def main() -> None:
    """Rewrite the document named on the command line."""
    rewrite_document(rewrite)


if __name__ == '__main__':
    main()
