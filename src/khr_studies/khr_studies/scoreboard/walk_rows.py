"""Compare walks with the thesis, one by one and as trends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import nan

from khr_studies.measuring import bench as runs
from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, MeasuredWalk
from khr_studies.measuring.json_file import finite_or_none, finite_or_none_all
from khr_studies.scoreboard.rows import ENOUGH, TrendRow, WalkRow, grows, kind_of

NOTICEABLE = 0.02  # smallest growth that counts, over the first value


def walk_row(
    row: thesis.ThesisWalk, walks: Sequence[MeasuredWalk], slips_from_mm: float = thesis.SEEN_MM
) -> WalkRow:
    """Compare one walk.

    Args:
        row: of the thesis.
        walks: one for each seed.
        slips_from_mm: slide per step from which on a robot slips; NaN if that is not known.
    """
    stayed = [one for one in walks if one.stayed_up]
    peaks = [[peak.frequency for peak in one.peaks[: thesis.SHOWN]] for one in stayed]
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
        finite_or_none(runs.vibration(walks)),
        tuple(peaks[0]) if peaks else (),
        tuple(differences),
        finite_or_none(runs.slide_mm(walks)),
        finite_or_none_all(runs.stance_mm(walks)),
        undecided=undecided,
    )


def slips_from_mm(bench: Bench) -> float:
    """Return the slide per step from which on the robot slips, mm; NaN if it cannot be said."""
    return max(thesis.SLIPS * runs.slide_mm(bench.walks(*thesis.UNSLIPPED)), thesis.SEEN_MM)


def trend_row(row: thesis.ThesisTrend, bench: Bench) -> TrendRow:
    """Compare a quantity over walks.

    Conditions are compared at the thesis's inclination if the robot stays up there with all of
    them.
    """
    steepest = max(row.inclinations_deg)
    grounds = [row.inclinations_deg]
    grounds += [(thesis.COMMON_DEG,)] if len(row.inclinations_deg) == 1 else []
    for ground in grounds:
        walks = [bench.walks(*walk) for walk in row.walks(ground)]
        if all(runs.share_up(some) > 0.5 for some in walks):
            break
    measure = {'vibration': runs.vibration, 'slide': runs.slide_mm, 'line': _extra_peak}
    values = [measure[row.quantity](some) for some in walks]
    least = thesis.LINE_HZ if row.quantity == 'line' else NOTICEABLE * values[0]
    undecided = bench.seeds < ENOUGH
    return TrendRow(
        5,
        kind_of(row.fitted),
        None if undecided else grows(values, least),
        row.what,
        row.quantity,
        steepest,
        max(ground),
        finite_or_none_all(values),
        undecided=undecided,
    )


def _differences(
    row: thesis.ThesisWalk,
    walks: Sequence[MeasuredWalk],
    peaks: Sequence[Sequence[float]],
    slips_from_mm: float,
) -> list[str]:
    """Return in words what differs from the published walk."""
    if (runs.share_up(walks) > 0.5) != row.survives:
        return ['does not stay up' if row.survives else 'stays up']
    if not row.survives:
        return []
    differences = []
    slide = runs.slide_mm(walks)
    if row.slips is True and not slide >= slips_from_mm:
        differences.append(f'does not slip: slides less than {slips_from_mm:.1f} mm')
    if row.slips is False and not slide < slips_from_mm:
        differences.append(f'slips: slides {slips_from_mm:.1f} mm or more')
    for number, (low, high) in enumerate(row.lines):
        seen = slice(1) if row.dominant and number == 0 else slice(thesis.SHOWN)
        if not _most(any(low <= f <= high for f in found[seen]) for found in peaks):
            what = (
                'is not the largest peak'
                if seen == slice(1)
                else f'not among {thesis.SHOWN} largest'
            )
            differences.append(f'{low:.2f} to {high:.2f} Hz {what}')
    differences += [
        f'still a peak in {low:.2f} to {high:.2f} Hz'
        for low, high in row.gone
        if _most(any(low <= f <= high for f in found) for found in peaks)
    ]
    return differences


def _most(seen: Iterable[bool]) -> bool:
    found = list(seen)
    return 2 * sum(found) > len(found)


def _extra_peak(walks: Iterable[MeasuredWalk]) -> float:
    """Return the median frequency of the largest peak above f_0 that is no multiple of it, Hz."""
    others = ([peak.frequency for peak in one.peaks if peak.label == 'other'] for one in walks)
    return runs.nanmedian(
        next((frequency for frequency in found if frequency > thesis.F_0[1]), nan)
        for found in others
    )
