"""The statements of chapter 5 on single walks and on trends over walks."""

from __future__ import annotations

from dataclasses import replace

from khr_studies.measuring.condition import Condition
from khr_studies.measuring.thesis_values import (
    F_0,
    F_1,
    F_2,
    F_A0,
    F_HIP,
    RUBBER,
    ThesisTrend,
    ThesisWalk,
    line,
    walking,
)


def _with_period(period: float) -> Condition:
    """Return the walk without control with another gait period, s."""
    return replace(walking(), changes=((('gait', 'cycle_period'), period),))


BY_FORCE = replace(walking(12.0), changes=((('ankle_controller', 'source'), 'force'),))
NONE, K_A_12, K_A_15, K_A_18 = walking(), walking(12.0), walking(15.0), walking(18.0)
K_H_12, K_H_13, K_H_14 = (walking(12.0, gain) for gain in (12.0, 13.0, 14.0))

# f_0 is among the four largest peaks with each K_A.
_F_0_AT_8_88 = tuple(
    ThesisWalk(8.88, each, '1.73 Hz is clearly observed for all K_A', 'Fig. 5.12(d)', lines=(F_0,))
    for each in (K_A_12, K_A_15, K_A_18)
)
# From 6.99 deg on.
_HARMONICS = tuple(
    ThesisWalk(
        phi,
        condition,
        'f_1 or f_2 is significant',
        f'Fig. 5.8({panel})',
        lines=(F_1, F_2),
        either=True,
    )
    for phi, condition, panel in (
        (6.99, K_A_12, 'c-1'),
        (7.68, K_A_12, 'c-2'),
        (8.88, K_A_18, 'd'),
    )
)
_BY_THE_HIP = tuple(
    ThesisWalk(phi, condition, 'peaks between 7.5 and 10 Hz', f'Fig. {figure}', lines=(F_HIP,))
    for phi, condition, figure in (
        (9.7, K_H_12, '5.12(a-3)'),
        (9.7, K_H_13, '5.12(a-2)'),
        (9.7, K_H_14, '5.12(a)'),
        (10.2, K_H_13, '5.9(b)'),
    )
)
# If f_0 were 4 / T_gait, as four peaks per cycle suggest, it would move to 2.11 and 1.48 Hz.
_PENDULUM = tuple(
    ThesisWalk(
        0.0,
        _with_period(period),
        f'f_0 is twice f_n of the pendulum, also with a gait period of {period:g} s',
        '5.5.1',
        lines=(F_0,),
        dominant=True,
    )
    for period in (1.9, 2.7)
)

WALKS = (
    ThesisWalk(
        0.0,
        NONE,
        'walks; a single dominant peak at 1.73 Hz',
        'Fig. 5.8(a)',
        lines=(F_0,),
        dominant=True,
        single=True,
        fitted=True,
    ),
    ThesisWalk(0.0, NONE, 'identical after the second cycle', '5.2.3', alike=True),
    *_PENDULUM,
    ThesisWalk(
        3.0,
        NONE,
        'a single dominant peak at 1.73 Hz up to 5.55 deg',
        '5.3',
        lines=(F_0,),
        dominant=True,
        single=True,
    ),
    ThesisWalk(
        5.55,
        NONE,
        'walks, the steepest without control; a single dominant peak at 1.73 Hz',
        'Fig. 5.8(b)',
        lines=(F_0,),
        dominant=True,
        single=True,
        fitted=True,
    ),
    ThesisWalk(
        6.99, NONE, 'falls at the start (beyond 5.55 deg)', '5.2.3', survives=False, fitted=True
    ),
    ThesisWalk(
        6.99, K_A_12, '1.73 Hz, and an extra peak at 2.58 Hz', 'Fig. 5.8(c-1)', lines=(F_0, F_A0)
    ),
    ThesisWalk(
        7.68, K_A_12, '1.73 Hz, and an extra peak at 2.58 Hz', 'Fig. 5.8(c-2)', lines=(F_0, F_A0)
    ),
    ThesisWalk(7.68, K_A_12, 'no slip yet', '5.2.3', slips=False),
    *_HARMONICS,
    ThesisWalk(8.5, BY_FORCE, 'walks by the force sensors up to 8.5 deg', 'abstract'),
    ThesisWalk(8.88, walking(6.0), 'a lower K_A is not sufficient', '5.2.3', survives=False),
    ThesisWalk(8.88, K_A_12, 'begins to slip', 'Fig. 5.12(d-3)', slips=True),
    *_F_0_AT_8_88,
    ThesisWalk(
        8.88,
        K_A_18,
        'the extra peak moves to 4.74 Hz',
        'Fig. 5.8(d)',
        lines=(line(4.74),),
        fitted=True,
    ),
    ThesisWalk(9.7, K_A_18, 'slips again', '5.2.3', slips=True),
    ThesisWalk(
        9.7,
        walking(24.0),
        'beyond K_A 18 vibration dominates the motion',
        '5.2.3',
        survives=None,
        dominated=True,
        fitted=True,
    ),
    ThesisWalk(9.7, K_H_12, 'slips', 'Fig. 5.12(a-3)', slips=True),
    *_BY_THE_HIP,
    ThesisWalk(
        9.7,
        K_H_14,
        'an additional peak at 8.40 Hz',
        'Fig. 5.9(a)',
        lines=(line(8.40),),
        fitted=True,
    ),
    ThesisWalk(9.7, K_H_14, '1.73 Hz no more observable', 'Fig. 5.9(a)', gone=(F_0,)),
    ThesisWalk(10.2, K_H_13, '1.73 Hz no more observable', 'Fig. 5.9(b)', gone=(F_0,)),
    ThesisWalk(10.2, K_H_13, 'walks; slips', '5.3', slips=True),
    ThesisWalk(
        10.7,
        K_H_13,
        'unstable beyond 10.2 deg, mostly because of slipping',
        '5.2.3',
        survives=False,
        slid_first=True,
    ),
    ThesisWalk(8.88, RUBBER[0], 'walks on rubber soles', '5.4', fitted=True),
    ThesisWalk(
        8.88, RUBBER[0], 'stable: neither slips nor vibrates', '5.4', slips=False, vibrates=False
    ),
    ThesisWalk(
        8.88,
        RUBBER[0],
        '1.73 Hz becomes dominant, 2.58 Hz reappears',
        'Fig. 5.13(b)',
        lines=(F_0, F_A0),
        dominant=True,
    ),
    ThesisWalk(9.7, RUBBER[1], 'walks on rubber soles', 'Fig. 5.14(a)', fitted=True),
    ThesisWalk(
        9.7, RUBBER[1], 'stable: neither slips nor vibrates', '5.4', slips=False, vibrates=False
    ),
    ThesisWalk(
        9.7,
        RUBBER[1],
        '1.73 Hz reappears; 8.40 Hz is lowered to 7.33 Hz',
        'Fig. 5.14(b)',
        lines=(F_0, line(7.33)),
    ),
)


def _on(inclination_deg: float, *conditions: Condition) -> tuple[tuple[Condition, float], ...]:
    return tuple((condition, inclination_deg) for condition in conditions)


TRENDS = (
    ThesisTrend(
        'feedback raises vibration: none, K_A 12, 18',
        'abstract, 5.6',
        'vibration',
        _on(5.55, NONE, K_A_12, K_A_18),
        fitted=True,
    ),
    ThesisTrend(
        'two motors vibrate more than one: K_A 12, with K_H 13',
        '5.2.3',
        'vibration',
        _on(5.55, K_A_12, K_H_13),
        fitted=True,
    ),
    ThesisTrend(
        'rubber lowers vibration: rubber K_A 12, smooth K_A 18',
        'abstract, 5.4',
        'vibration',
        _on(8.88, RUBBER[0], K_A_18),
        fitted=True,
    ),
    ThesisTrend(
        'rubber reduces vibration drastically: rubber K_H 12, smooth K_H 14',
        '5.4',
        'vibration',
        _on(9.7, RUBBER[1], K_H_14),
        least=1.0,
        fitted=True,
    ),
    ThesisTrend(
        'the amplitude of the rate grows with phi, no control: 0, 3, 5.55 deg',
        'Fig. 5.6, 5.5.4',
        'amplitude',
        tuple((NONE, phi) for phi in (0.0, 3.0, 5.55)),
        fitted=True,
    ),
    ThesisTrend(
        'the amplitude of the rate grows with phi, K_A 12: 6.99, 7.68, 8.88 deg',
        'Fig. 5.6, 5.5.4',
        'amplitude',
        tuple((K_A_12, phi) for phi in (6.99, 7.68, 8.88)),
    ),
    ThesisTrend(
        'slides further per step on a steeper slope, K_A 12: 6.99, 7.68, 8.88 deg',
        '5.2.3',
        'slide',
        tuple((K_A_12, phi) for phi in (6.99, 7.68, 8.88)),
    ),
    ThesisTrend(
        'slides less per step with K_A 18 than with 12',
        '5.2.3',
        'slide',
        _on(8.88, K_A_18, K_A_12),
    ),
    ThesisTrend(
        'the hip reduces slipping: K_H 13 with K_A 12, K_A 18',
        '5.2.3',
        'slide',
        _on(9.7, K_H_13, K_A_18),
    ),
    ThesisTrend(
        'slipping dominates at lower K_H: 14, 13, 12',
        '5.2.3',
        'slide',
        _on(9.7, K_H_14, K_H_13, K_H_12),
    ),
    ThesisTrend(
        'vibration grows much with K_A: 12, 15, 18',
        '5.2.3, Fig. 5.12',
        'vibration',
        _on(8.88, K_A_12, K_A_15, K_A_18),
        least=0.25,
    ),
    ThesisTrend(
        'the hip raises the oscillation: K_A 18, K_H 13 with K_A 12',
        '5.2.3',
        'vibration',
        _on(9.7, K_A_18, K_H_13),
    ),
    ThesisTrend(
        'vibration grows with K_H: 12, 13, 14',
        'Fig. 5.7(a)',
        'vibration',
        _on(9.7, K_H_12, K_H_13, K_H_14),
    ),
    ThesisTrend('the extra peak rises with K_A: 12, 18', '5.3', 'line', _on(8.88, K_A_12, K_A_18)),
)


def published_lines() -> dict[tuple[float, Condition], tuple[tuple[float, float], ...]]:
    """Return the published peaks of each walk at the gait period of the thesis, Hz."""
    found: dict[tuple[float, Condition], tuple[tuple[float, float], ...]] = {}
    for row in WALKS:
        if row.lines and not row.either and not row.condition.changes:
            walk = row.inclination_deg, row.condition
            known = found.get(walk, ())
            found[walk] = known + tuple(each for each in row.lines if each not in known)
    return found
