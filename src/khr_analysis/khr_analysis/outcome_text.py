"""An outcome as texts by name, each with its unit, for a topic, a table or a file."""

from __future__ import annotations

from math import degrees

from khr_analysis.outcome import Outcome

# How people read a quantity; rates are shown in deg/s.
LABELS = {
    'time_s': 'judged until, s',
    'fell_at_s': 'fell at, s',
    'distance_m': 'distance along the surface, m',
    'lateral_drift_m': 'drift to the left, m',
    'largest_pitch_deg': 'largest pitch, deg',
    'slip_distance_m': 'slip, all steps, m',
    'largest_slip_m': 'slip, largest of a step, m',
    'vibration_rad_s': 'vibration, deg/s',
}


def quantities(outcome: Outcome) -> dict[str, str]:
    """Return the quantities of an outcome; ``fell_at_s`` is there only after a fall."""
    values = {'time_s': f'{outcome.time:.3f}'}
    if outcome.fell_at is not None:
        values['fell_at_s'] = f'{outcome.fell_at:.3f}'
    return values | {
        'distance_m': f'{outcome.distance:.4f}',
        'lateral_drift_m': f'{outcome.lateral_drift:.4f}',
        'largest_pitch_deg': f'{degrees(outcome.largest_pitch):.2f}',
        'slip_distance_m': f'{outcome.slip_distance:.4f}',
        'largest_slip_m': f'{outcome.largest_slip:.4f}',
        'vibration_rad_s': f'{outcome.vibration:.4f}',
    }


def shown(name: str, value: str) -> str:
    """Return a quantity as it stands beside its label: rates in deg/s."""
    return f'{degrees(float(value)):.2f}' if name.endswith('_rad_s') else value
