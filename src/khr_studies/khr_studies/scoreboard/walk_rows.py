"""Compare walks with the thesis, one by one and as trends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, median_up, share_up
from khr_studies.measuring.json_file import finite_or_none, finite_or_none_all
from khr_studies.scoreboard.rows import ENOUGH, TrendRow, WalkRow, grows, kind_of

NOTICEABLE = 0.02  # smallest growth that counts, as a share of the first value
COLUMNS = {'vibration': 'vibration_rad_s', 'slide': 'slide_mm', 'line': 'extra_peak_hz'}


def walk_row(
    row: thesis.ThesisWalk, walks: pd.DataFrame, slips_from_mm: float = thesis.SEEN_MM
) -> WalkRow:
    """Compare one walk.

    Args:
        row: of the thesis.
        walks: one run per seed.
        slips_from_mm: slide per step at which a robot slips; NaN if it is not known.
    """
    stayed = walks[walks['stayed_up']]
    peaks = [found[: thesis.SHOWN] for found in stayed['peaks_hz']]
    differences = _differences(row, walks, peaks, slips_from_mm)
    undecided = 0 < len(stayed) < len(walks) or len(walks) < ENOUGH
    return WalkRow(
        5,
        kind_of(row.condition in thesis.FITTED),
        None if undecided else not differences,
        row.inclination_deg,
        row.condition.title.removeprefix('walk, '),
        row.thesis,
        row.survives,
        len(walks),
        len(walks) - len(stayed),
        finite_or_none(median_up(walks, 'vibration_rad_s')),
        tuple(peaks[0]) if peaks else (),
        tuple(differences),
        finite_or_none(median_up(walks, 'slide_mm')),
        finite_or_none_all([median_up(walks, name) for name in ('before_mm', 'after_mm')]),
        undecided=undecided,
    )


def slips_from_mm(bench: Bench) -> float:
    """Return the slide per step at which the robot slips, mm; NaN if it cannot be measured."""
    slide_mm = median_up(bench.walks(*thesis.UNSLIPPED), 'slide_mm')
    return max(thesis.SLIPS * slide_mm, thesis.SEEN_MM)


def trend_row(row: thesis.ThesisTrend, bench: Bench) -> TrendRow:
    """Compare a quantity over walks.

    Conditions are compared at the inclination of the thesis if the robot stays up there with all
    of them, and otherwise on a common gentler slope.
    """
    slopes = [row.inclinations_deg]
    slopes += [(thesis.COMMON_DEG,)] if len(row.inclinations_deg) == 1 else []
    for slope in slopes:
        walks = [bench.walks(*walk) for walk in row.walks(slope)]
        if all(share_up(runs) > 0.5 for runs in walks):
            break
    values = [median_up(runs, COLUMNS[row.quantity]) for runs in walks]
    least = thesis.LINE_HZ if row.quantity == 'line' else NOTICEABLE * values[0]
    undecided = bench.seeds < ENOUGH
    return TrendRow(
        5,
        kind_of(row.fitted),
        None if undecided else grows(values, least),
        row.name,
        row.quantity,
        max(row.inclinations_deg),
        max(slope),
        finite_or_none_all(values),
        undecided=undecided,
    )


def _differences(
    row: thesis.ThesisWalk,
    walks: pd.DataFrame,
    peaks: Sequence[Sequence[float]],
    slips_from_mm: float,
) -> list[str]:
    """Return in words how walks differ from the published one."""
    if (share_up(walks) > 0.5) != row.survives:
        return ['does not stay up' if row.survives else 'stays up']
    if not row.survives:
        return []
    differences = []
    slide = median_up(walks, 'slide_mm')
    if row.slips is True and not slide >= slips_from_mm:
        differences.append(f'does not slip: slides less than {slips_from_mm:.1f} mm')
    if row.slips is False and not slide < slips_from_mm:
        differences.append(f'slips: slides {slips_from_mm:.1f} mm or more')
    for number, (low, high) in enumerate(row.lines):
        count = 1 if row.dominant and number == 0 else thesis.SHOWN
        if not _most(any(low <= f <= high for f in found[:count]) for found in peaks):
            place = 'is not the largest peak' if count == 1 else f'not among {count} largest'
            differences.append(f'{low:.2f} to {high:.2f} Hz {place}')
    differences += [
        f'still a peak in {low:.2f} to {high:.2f} Hz'
        for low, high in row.gone
        if _most(any(low <= f <= high for f in found) for found in peaks)
    ]
    return differences


def _most(seen: Iterable[bool]) -> bool:
    found = list(seen)
    return 2 * sum(found) > len(found)
