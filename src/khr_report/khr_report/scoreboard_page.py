"""The scoreboard as a page: its lines, tables and texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan

from khr_experiments.critical import VIBRATES
from khr_experiments.published import COMMON_DEG, TOLERANCE_DEG


@dataclass(frozen=True)
class Row:
    """One line of the scoreboard; ``passed`` is None where there is nothing to compare with."""

    cells: tuple[str, ...]
    kind: str
    difference: str
    passed: bool | None

    @property
    def line(self) -> str:
        """Return the line as Markdown."""
        verdict = {True: 'pass', False: '**miss**', None: 'no number published'}[self.passed]
        return '| ' + ' | '.join((*self.cells, self.kind, self.difference, verdict)) + ' |'


def kind(fitted: bool) -> str:
    """Say whether the calibration saw a row."""
    return 'fitted' if fitted else 'predicted'


def number(value: float, decimals: int) -> str:
    """Write a number; a dash for one that could not be measured."""
    return '-' if isnan(value) else f'{value:.{decimals}f}'


def series(values: Sequence[float], decimals: int = 1) -> str:
    """Write several numbers."""
    return ', '.join(number(value, decimals) for value in values)


def head(heads: Sequence[str]) -> str:
    """Return the head of a Markdown table."""
    return f'| {" | ".join(heads)} |\n|{"---|" * len(heads)}'


def table(heads: tuple[str, ...], rows: Sequence[Row]) -> str:
    """Return rows as a Markdown table."""
    return (
        '\n'.join((head((*heads, 'kind', 'difference', 'verdict')), *(row.line for row in rows)))
        + '\n'
    )


HEAD = """# Scoreboard

What the robot of Dutta (2021) did, and what the simulated one does. Written by `khr scoreboard`
with {seeds} seeds; do not edit. *Fitted* rows were seen by the calibration
([calibration.md](calibration.md)), all others are predictions. A row that misses stays.
"""
LIMITS_TEXT = f"""In degrees, with the 95 % confidence interval over the seeds. A limit passes
within {TOLERANCE_DEG:g} deg. The thesis's limit of a control is the steepest ground it walked on
with it. Beside it: how many seeds slipped (a sole slid by a quarter of a step) and vibrated (more
than {VIBRATES:g} rad/s above 4 Hz) on the steepest ground that they survived. The calibration
saw that the walk with K_A 12 holds at 7.68 deg, but not its limit."""
STANDING_TEXT = """Mean forces on the support foot while the other is up; the board is tilted
under the standing robot. phi is read back by interpolating Delta on the curve of whole degrees."""
WALKING_TEXT = f"""Figures are medians over the walks without a fall; peaks are of the torso's
true pitch rate over Gait-3, of the first such seed. 2.58 Hz is also line 6 of the gait's own
cycle (2.60 Hz), so finding it says little. More than {VIBRATES:g} rad/s is called vibration."""
TRENDS_TEXT = f"""On the thesis's ground if most seeds stay up there, else at
{COMMON_DEG:g} deg."""
MISSES_TEXT = """The best explanation that an experiment could find: for each limit that misses,
the limit of seed 0 is measured again with one change at a time; the numbers are degrees gained or
lost. These are no calibrations: what moves one limit moves the fitted ones as well."""
MOTION_TEXT = {
    'walk': 'Walking:',
    'leg_lift': """Standing. A rate is zero at rest, so feedback of a rate, (3.14), holds no lean:
it can only damp the way there. What hip control is worth is in the first two columns.""",
}
