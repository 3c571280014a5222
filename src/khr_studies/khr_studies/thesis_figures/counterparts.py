"""What the thesis shows in each of its figures, and what stands here in its place."""

from __future__ import annotations

from dataclasses import dataclass

from khr_analysis.peaks import DOMINANT_SHARE


@dataclass(frozen=True)
class Counterpart:
    """A figure of the thesis beside the one that is drawn here.

    Attributes:
        there: what its panels show.
        panels: how many are drawn here, of runs in which every seed stays up.
        here: what they show.
        missing: what of the thesis is not drawn, and why; empty if all is.
    """

    there: str
    panels: int
    here: str
    missing: str = ''


CURVES = 'its measured points: printed as curves, without numbers'
COUNTERPARTS: dict[str, Counterpart] = {
    '3.4': Counterpart(
        'toe and heel force of the support foot over a leg lift at 3.8°; 2.7, 3.8 and 5.3° compared',
        3,
        'toe and heel at 3.8°; toe, and heel, at the three inclinations',
    ),
    '3.5': Counterpart('toe and heel force over φ, for each leg', 2, 'left leg; right leg'),
    '3.6': Counterpart(
        'Δ over φ in the three stages',
        1,
        "the robot in the three stages, with (3.7) and (3.13), and the thesis's limits",
        CURVES,
    ),
    '3.8': Counterpart(
        'θ_A over time of (3.6), for several φ', 2, '(3.6) as published; and physical'
    ),
    '3.9': Counterpart(
        'φ_cr over θ_A0',
        2,
        '(3.10), exact and by the tangent, with the point of the thesis; their difference',
    ),
    '3.10': Counterpart(
        'Δ over φ of theory and simulation, left and right leg',
        1,
        '(3.7), (3.11) settled, and the robot on each leg',
    ),
    '3.11b': Counterpart(
        'armature voltage of the servo over its error voltage, at −84.3, 0 and +84.3°',
        1,
        'output of (3.12) over its error: one curve, as (3.12) is the same at every angle',
        'the measured voltages: the model has no armature, and they are printed as curves',
    ),
    '3.12': Counterpart(
        'step of θ_A by (3.11) and its pitch rate, for several φ; the robot at 7.6 and 9.5°',
        6,
        'lean, and pitch rate, as published and physical; the robot with the ankle, and with both',
        CURVES,
    ),
    '3.13': Counterpart(
        'largest pitch rate over φ, calculated and measured, which rises abruptly beyond 7.6°',
        1,
        'the step of (3.11) in both forms, and the robot in three stages; a line at 7.6°',
        CURVES,
    ),
    '3.15': Counterpart('Δ over φ for raised K_A', 1, 'the robot with K_A 0 to 24', CURVES),
    '4.4': Counterpart(
        'V_out, modulated by a sinusoidal rate', 2, 'the rate; V_out of the circuit'
    ),
    '4.5': Counterpart('the demodulated output', 1, 'the output of the circuit beside the rate'),
    '4.6': Counterpart(
        'output over the rate, a straight line', 1, 'the settled circuit beside (5.2)'
    ),
    '4.8': Counterpart(
        'pitch rate over time under a growing force',
        4,
        "the thesis's model in both forms; the model of the robot's body; the robot",
    ),
    '4.10': Counterpart(
        'the mechanism of recovery',
        2,
        'x_COM of (4.4) to (4.6) over time, as published; and physical',
        'the drawing of the mechanism: no quantity is in it',
    ),
    '4.11': Counterpart(
        'x_COM over time with and without control, against the band (4.7)',
        2,
        'the robot; the model of its body',
    ),
    '4.12': Counterpart(
        'x_COM for pushes from behind and from the front',
        3,
        'the model on the flat; at 2°; the robot',
    ),
    '5.5': Counterpart(
        'pitch rate of a whole walk; of Gait-3',
        2,
        'a whole walk; Gait-3, its peaks numbered',
        CURVES,
    ),
    '5.6': Counterpart(
        'Gait-3 by φ without control, with K_A 12, and with K_A 18, over that at 0°',
        11,
        'the same, and at 1.5, 4.5 and 5.55° (K_A 12), where the robot walks',
        CURVES,
    ),
    '5.7': Counterpart(
        'Gait-3 by φ with ankle and hip, over that at 0°',
        3,
        'the same, and at 6.99°, where the robot walks',
        CURVES,
    ),
    '5.8': Counterpart(
        'amplitude spectra of Gait-3 by φ, without control, and with the ankle',
        11,
        'the walks of 5.6, with the published peaks of each',
        CURVES,
    ),
    '5.9': Counterpart(
        'amplitude spectra of Gait-3 by φ, with ankle and hip',
        3,
        'the walks of 5.7, with the published peaks of each',
        CURVES,
    ),
    '5.10': Counterpart(
        f'phase of Gait-3 where the amplitude is at least {100 * DOMINANT_SHARE:.0f} % of the largest',
        14,
        'the walks of 5.6 and 5.7; marks at the published peaks',
        'its phases: printed as points, without numbers',
    ),
    '5.11': Counterpart(
        'dominant frequencies over φ',
        1,
        'the tones of the gait, f_A0, the published peaks, and those of the robot',
    ),
    '5.12': Counterpart(
        'spectra with K_A 12, 15 and 18 at 8.88°, and with K_H 12, 13 and 14 at 9.7°',
        6,
        'the same six; paler, the same gains at 6.99°, where the robot walks',
        CURVES,
    ),
    '5.13': Counterpart(
        '(a) smooth against rubber soles, K_A 12; (b) smooth with K_A 18 against rubber with 12; '
        '(c) phase',
        8,
        '(a), (b), (c) and the slip, at 8.88° and on gentler ground',
        CURVES,
    ),
    '5.14': Counterpart(
        'smooth against rubber soles with ankle and hip',
        6,
        'spectrum, phase and slip, at 9.7° and on gentler ground',
        CURVES,
    ),
}
