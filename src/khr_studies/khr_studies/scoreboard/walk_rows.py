"""Compare walks with the thesis, one by one and as trends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import pandas as pd

from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, median_up, share_up
from khr_studies.scoreboard.rows import ENOUGH, grows, kind_of, row
from khr_sweeps.trial import Row

NOTICEABLE = 0.02  # smallest growth that counts, as a share of the first value
COLUMNS = {'vibration': 'vibration_rad_s', 'slide': 'slide_mm', 'line': 'extra_peak_hz'}


def walk_row(
    published: thesis.ThesisWalk, walks: pd.DataFrame, slips_from_mm: float = thesis.SEEN_MM
) -> Row:
    """Compare one walk.

    Args:
        published: of the thesis.
        walks: one run per seed.
        slips_from_mm: slide per step at which a robot slips; NaN if it is not known.

    Returns:
        A record with ``inclination_deg`` and ``control``; ``thesis`` (its result in words) and
        ``survives``; ``runs`` and ``lost``; of the walks that stayed up the medians ``vibration``
        (rad/s), ``slide_mm`` per step and ``stance_mm`` (before and after the steps), and the
        ``peaks_hz`` of the first of them, largest first; ``differences`` from the thesis in words.
    """
    stayed = walks[walks['stayed_up']]
    peaks = [found[: thesis.SHOWN] for found in stayed['peaks_hz']]
    differences = _differences(published, walks, peaks, slips_from_mm)
    undecided = 0 < len(stayed) < len(walks) or len(walks) < ENOUGH
    return row(
        5,
        kind_of(published.condition in thesis.FITTED),
        None if undecided else not differences,
        inclination_deg=published.inclination_deg,
        control=published.condition.title.removeprefix('walk, '),
        thesis=published.thesis,
        survives=published.survives,
        runs=len(walks),
        lost=len(walks) - len(stayed),
        vibration=median_up(walks, 'vibration_rad_s'),
        peaks_hz=peaks[0] if peaks else (),
        differences=differences,
        slide_mm=median_up(walks, 'slide_mm'),
        stance_mm=[median_up(walks, name) for name in ('before_mm', 'after_mm')],
    )


def slips_from_mm(bench: Bench) -> float:
    """Return the slide per step at which the robot slips, mm; NaN if it cannot be measured."""
    slide_mm = median_up(bench.walks(*thesis.UNSLIPPED), 'slide_mm')
    return max(thesis.SLIPS * slide_mm, thesis.SEEN_MM)


def trend_row(published: thesis.ThesisTrend, bench: Bench) -> Row:
    """Compare a quantity over walks.

    Conditions are compared at the inclination of the thesis if the robot stays up there with all
    of them, and otherwise on a common gentler slope.

    Returns:
        A record with ``name``, the claim of the thesis; ``quantity``: slide (mm), vibration
        (rad/s) or line (Hz); ``thesis_deg`` and ``inclination_deg``, the steepest slopes of the
        thesis and of the measurement; ``values``, one for each walk.
    """
    slopes = [published.inclinations_deg]
    slopes += [(thesis.COMMON_DEG,)] if len(published.inclinations_deg) == 1 else []
    for slope in slopes:
        walks = [bench.walks(*walk) for walk in published.walks(slope)]
        if all(share_up(runs) > 0.5 for runs in walks):
            break
    values = [median_up(runs, COLUMNS[published.quantity]) for runs in walks]
    least = thesis.LINE_HZ if published.quantity == 'line' else NOTICEABLE * values[0]
    return row(
        5,
        kind_of(published.fitted),
        grows(values, least) if bench.seeds >= ENOUGH else None,
        name=published.name,
        quantity=published.quantity,
        thesis_deg=max(published.inclinations_deg),
        inclination_deg=max(slope),
        values=values,
    )


def _differences(
    published: thesis.ThesisWalk,
    walks: pd.DataFrame,
    peaks: Sequence[Sequence[float]],
    slips_from_mm: float,
) -> list[str]:
    """Return in words how walks differ from the published one."""
    if (share_up(walks) > 0.5) != published.survives:
        return ['does not stay up' if published.survives else 'stays up']
    if not published.survives:
        return []
    differences = []
    slide = median_up(walks, 'slide_mm')
    if published.slips is True and not slide >= slips_from_mm:
        differences.append(f'does not slip: slides less than {slips_from_mm:.1f} mm')
    if published.slips is False and not slide < slips_from_mm:
        differences.append(f'slips: slides {slips_from_mm:.1f} mm or more')
    for number, (low, high) in enumerate(published.lines):
        count = 1 if published.dominant and number == 0 else thesis.SHOWN
        if not _most(any(low <= f <= high for f in found[:count]) for found in peaks):
            place = 'is not the largest peak' if count == 1 else f'not among {count} largest'
            differences.append(f'{low:.2f} to {high:.2f} Hz {place}')
    differences += [
        f'still a peak in {low:.2f} to {high:.2f} Hz'
        for low, high in published.gone
        if _most(any(low <= f <= high for f in found) for found in peaks)
    ]
    return differences


def _most(seen: Iterable[bool]) -> bool:
    found = list(seen)
    return 2 * sum(found) > len(found)
