"""Convert an outcome to named numbers for a file or a topic, and to text for users."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import Any, cast, get_args

from khr_analysis.outcome import Outcome, SensedOutcome, SensedVerdict, Verdict
from khr_analysis.outcome_measures import Slides
from khr_common.errors import MalformedError
from khr_common.statuses import integer, real

Value = float | int | str
BY_SENSORS = 'sensors'
FELL_AT, STEPS = 'fell_at_s', 'steps'
# Attributes by name; a name ends in the SI unit of its number.
_COMMON = {'time_s': 'time', FELL_AT: 'fell_at'}
_SENSED = _COMMON | {'fastest_rad_s': 'fastest', 'vibration_rad_s': 'vibration'}
_TRUE = _COMMON | {
    'distance_m': 'distance',
    'lateral_drift_m': 'lateral_drift',
    'largest_pitch_rad': 'largest_pitch',
    'slip_distance_m': 'slip_distance',
    'largest_slip_m': 'largest_slip',
    'vibration_rad_s': 'vibration',
}
_STANCE = {'slide_before_m': 'before'}
_SLIDES = {STEPS: 'steps', 'step_slide_m': 'per_step', **_STANCE, 'slide_after_m': 'after'}
LABELS = {  # shown to users, with angles in deg
    'time_s': 'judged until, s',
    FELL_AT: 'fell at, s',
    'distance_m': 'distance along the surface, m',
    'lateral_drift_m': 'drift to the left, m',
    'largest_pitch_rad': 'largest pitch, deg',
    'slip_distance_m': 'net slip of both soles, m',
    'largest_slip_m': 'largest slip in one stance, m',
    STEPS: 'steps',
    'step_slide_m': 'slide per step, m',
    'slide_before_m': 'slide before the first step, m',
    'slide_after_m': 'slide after the last step, m',
    'vibration_rad_s': 'vibration, deg/s',
    'fastest_rad_s': 'fastest rate, deg/s',
    'judged_by': 'judged by',
}


def values_of(outcome: Outcome | SensedOutcome) -> dict[str, Value]:
    """Return the numbers of an outcome in SI units; :func:`outcome_of` returns the same outcome.

    The time of a fall is present only after a fall, the slides of steps only after a step.
    """
    if isinstance(outcome, SensedOutcome):
        return _attributes(outcome, _SENSED) | {'judged_by': BY_SENSORS}
    slides = outcome.slides
    return _attributes(outcome, _TRUE) | _attributes(slides, _SLIDES if slides.steps else _STANCE)


def outcome_of(verdict: str, values: Mapping[str, Any]) -> Outcome | SensedOutcome:
    """Return the outcome of a verdict and its numbers, which may be written as texts.

    Raises:
        MalformedError: if there is no such verdict, or a number is missing or not finite.
    """
    sensed = values.get('judged_by') == BY_SENSORS
    if verdict not in get_args(SensedVerdict if sensed else Verdict):
        raise MalformedError('no such verdict')
    if sensed:
        return SensedOutcome(cast(SensedVerdict, verdict), **_numbers(values, _SENSED))
    slides: Any = _numbers(values, _SLIDES if STEPS in values else _STANCE)
    return Outcome(cast(Verdict, verdict), **_numbers(values, _TRUE), slides=Slides(**slides))


def shown(name: str, value: Value) -> str:
    """Return a value as text for users, to follow its label."""
    if isinstance(value, str | int):
        return str(value)
    if '_rad' in name:
        return f'{degrees(value):.2f}'
    return f'{value:.{4 if name.endswith("_m") else 3}f}'


def labelled(outcome: Outcome | SensedOutcome | None) -> dict[str, str]:
    """Return an outcome as text for users, by label; empty for a run that was not judged."""
    values = {} if outcome is None else values_of(outcome)
    return {label: shown(name, values[name]) for name, label in LABELS.items() if name in values}


def _attributes(of: object, names: Mapping[str, str]) -> dict[str, Value]:
    found = {name: getattr(of, attribute) for name, attribute in names.items()}
    return {name: value for name, value in found.items() if value is not None}


def _numbers(values: Mapping[str, Any], names: Mapping[str, str]) -> dict[str, Any]:
    return {
        attribute: None
        if name == FELL_AT and name not in values
        else (integer if name == STEPS else real)(values, name)
        for name, attribute in names.items()
    }
