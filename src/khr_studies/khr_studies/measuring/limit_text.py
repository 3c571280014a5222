"""A critical inclination in words, for the command that measures it."""

from __future__ import annotations

from math import degrees

import numpy as np

from khr_studies.measuring.condition import Condition
from khr_studies.measuring.limit import VIBRATES, Attempt, Limit


def attempt_text(attempt: Attempt) -> str:
    """Format an attempt as one line."""
    outcome = attempt.outcome
    return (
        f'{attempt.inclination_deg:6.2f} deg  seed {attempt.seed}  {outcome.verdict:8}'
        f'slip {outcome.largest_slip * 1000:5.1f} mm  '
        f'vibration {degrees(outcome.vibration):5.1f} deg/s'
    )


def limit_text(condition: Condition, limit: Limit) -> str:
    """Format a limit, its interval, and slip and vibration just below it."""
    seeds = len(limit.of_seeds)
    scatter = f'95 %, {seeds} seeds' if seeds > 1 else 'one seed; its scatter is taken from others'
    of_seeds = '  '.join(f'{one:.2f}' for one in sorted(limit.of_seeds))
    return (
        f'{limit.mean:.2f} +- {limit.half_width:.2f} deg ({scatter})  {condition.title}\n'
        f'seeds      {of_seeds} deg\n'
        f'just below {_verdict("slips", limit.slipped)}, {_verdict("vibrates", limit.vibrated)} '
        f'({degrees(limit.vibration):.1f} deg/s above 4 Hz, limit {degrees(VIBRATES):.1f})'
    )


def _verdict(word: str, share: float) -> str:
    if np.isnan(share):
        return f'{word}: never stayed up'
    return f'{word} with {share:.0%} of the seeds'
