"""An outcome as texts by name, each with its unit, for a topic, a table or a file."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, radians
from typing import cast, get_args

from khr_analysis.outcome import Outcome, SensedOutcome, SensedVerdict, Verdict
from khr_analysis.outcome_measures import Slides
from khr_common.figures import figure, whole
from khr_common.run_identity import MalformedError

# How people read a quantity; rates are shown in deg/s.
WORDS = ('judged_by',)  # no quantities: how it was judged
LABELS = {
    'time_s': 'judged until, s',
    'fell_at_s': 'fell at, s',
    'distance_m': 'distance along the surface, m',
    'lateral_drift_m': 'drift to the left, m',
    'largest_pitch_deg': 'largest pitch, deg',
    'slip_distance_m': 'slip, all steps, m',
    'largest_slip_m': 'slip, largest of a time on the ground, m',
    'steps': 'steps',
    'step_slide_m': 'slide per step, m',
    'slide_before_m': 'slide before the first step, m',
    'slide_after_m': 'slide after the last step, m',
    'vibration_rad_s': 'vibration, deg/s',
    'fastest_rad_s': 'fastest rate, deg/s',
    'judged_by': 'judged by',
}


BY_SENSORS = 'sensors'


def quantities(outcome: Outcome | SensedOutcome) -> dict[str, str]:
    """Return the quantities of an outcome; those of a fall or of steps if there were any."""
    values = {'time_s': f'{outcome.time:.3f}'}
    if outcome.fell_at is not None:
        values['fell_at_s'] = f'{outcome.fell_at:.3f}'
    if isinstance(outcome, SensedOutcome):
        return values | {
            'fastest_rad_s': f'{outcome.fastest:.4f}',
            'vibration_rad_s': f'{outcome.vibration:.4f}',
            'judged_by': BY_SENSORS,
        }
    return values | {
        'distance_m': f'{outcome.distance:.4f}',
        'lateral_drift_m': f'{outcome.lateral_drift:.4f}',
        'largest_pitch_deg': f'{degrees(outcome.largest_pitch):.2f}',
        'slip_distance_m': f'{outcome.slip_distance:.4f}',
        'largest_slip_m': f'{outcome.largest_slip:.4f}',
        'vibration_rad_s': f'{outcome.vibration:.4f}',
        **_slides(outcome.slides),
    }


def _slides(slides: Slides) -> dict[str, str]:
    before = {'slide_before_m': f'{slides.before:.4f}'}
    if not slides.steps:
        return before
    return {
        'steps': f'{slides.steps}',
        'step_slide_m': f'{slides.per_step:.4f}',
        **before,
        'slide_after_m': f'{slides.after:.4f}',
    }


def _slides_of(values: Mapping[str, str]) -> Slides:
    before = figure(values, 'slide_before_m') if 'slide_before_m' in values else 0.0
    if 'steps' not in values:
        return Slides(before)
    return Slides(
        before,
        figure(values, 'step_slide_m'),
        figure(values, 'slide_after_m'),
        whole(values, 'steps'),
    )


def outcome_of(verdict: str, values: Mapping[str, str]) -> Outcome | SensedOutcome:
    """Return the outcome that a verdict and its :func:`quantities` stand for.

    Raises:
        MalformedError: if there is no such verdict, or a quantity is missing or no number.
    """
    sensed = values.get('judged_by') == BY_SENSORS
    if verdict not in get_args(SensedVerdict if sensed else Verdict):
        raise MalformedError('no such verdict')
    if sensed:
        return SensedOutcome(
            cast(SensedVerdict, verdict),
            figure(values, 'time_s'),
            figure(values, 'fell_at_s') if 'fell_at_s' in values else None,
            figure(values, 'fastest_rad_s'),
            figure(values, 'vibration_rad_s'),
        )
    return Outcome(
        cast(Verdict, verdict),
        figure(values, 'time_s'),
        figure(values, 'fell_at_s') if 'fell_at_s' in values else None,
        figure(values, 'distance_m'),
        figure(values, 'lateral_drift_m'),
        radians(figure(values, 'largest_pitch_deg')),
        figure(values, 'slip_distance_m'),
        figure(values, 'largest_slip_m'),
        figure(values, 'vibration_rad_s'),
        _slides_of(values),
    )


def shown(name: str, value: str) -> str:
    """Return a quantity as it stands beside its label: rates in deg/s."""
    return f'{degrees(float(value)):.2f}' if name.endswith('_rad_s') else value
