"""Compare walks with the thesis, one by one and as trends."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import nan

import pandas as pd

from khr_studies.measuring import thesis_values as thesis
from khr_studies.measuring.bench import Bench, median_up, share_up
from khr_studies.measuring.critical import VIBRATES
from khr_studies.scoreboard.rows import ENOUGH, grows, kind_of, row
from khr_sweeps.trial import Row

COLUMNS = {
    'vibration': 'vibration_rad_s',
    'slide': 'slide_mm',
    'line': 'extra_peak_hz',
    'amplitude': 'amplitude_rad_s',
}


def walk_row(
    published: thesis.ThesisWalk,
    walks: pd.DataFrame,
    slips_from_mm: float = thesis.VISIBLE_SLIDE_MM,
) -> Row:
    """Compare one walk.

    Args:
        walks: one run per seed.
        slips_from_mm: slide per step at which a robot slips; NaN if it is not known.

    Returns:
        A record with ``inclination_deg`` and ``control``; ``thesis`` (its statement),
        ``source``, ``criterion`` in words and ``survives``; ``runs`` and ``lost``; of the walks
        that stayed up the medians ``vibration`` (rad/s), ``slide_mm`` per step, ``stance_mm``
        (before and after the steps) and ``alike`` (correlations of cycles 1 and 2, and of 3 and
        4), and the ``peaks_hz`` of the first of them, largest first; ``differences`` from the
        thesis in words.
    """
    stayed = walks[walks['stayed_up']]
    peaks = [found[: thesis.SHOWN] for found in stayed['peaks_hz']]
    split = published.survives is not None and 0 < len(stayed) < len(walks)
    differences = [*_differences(published, walks, slips_from_mm)]
    return row(
        5,
        kind_of(published.fitted),
        None if split or len(walks) < ENOUGH else not differences,
        inclination_deg=published.inclination_deg,
        control=published.condition.label.removeprefix('walk, '),
        thesis=published.thesis,
        source=published.source,
        criterion=criterion(published),
        survives=published.survives,
        runs=len(walks),
        lost=len(walks) - len(stayed),
        vibration=median_up(walks, 'vibration_rad_s'),
        peaks_hz=peaks[0] if peaks else (),
        differences=differences,
        slide_mm=median_up(walks, 'slide_mm'),
        stance_mm=[median_up(walks, name) for name in ('before_mm', 'after_mm')],
        alike=[median_up(walks, name) for name in ('early', 'late')],
    )


def criterion(published: thesis.ThesisWalk) -> str:
    """Return in words when most seeds of a walk agree with the thesis."""
    words = [{True: 'stays up', False: 'is lost', None: ''}[published.survives]]
    words += ['slid before it tipped'] if published.slid_first else []
    words += ['most power above 4 Hz'] if published.dominated else []
    words += {True: ['slips'], False: ['does not slip'], None: []}[published.slips]
    words += {True: ['vibrates'], False: ['does not vibrate'], None: []}[published.vibrates]
    words += [f'{_ranges(group)} {_place(count)}' for group, count in _lines(published)]
    words += ['no other peak above half of it'] if published.single else []
    words += [
        f'no peak in {_range(gone)} among the {thesis.SHOWN} largest' for gone in published.gone
    ]
    words += (
        [f'cycles 3 and 4 correlate by {thesis.ALIKE_CORRELATION:g} and more than 1 and 2']
        if published.alike
        else []
    )
    return '; '.join(filter(None, words))


def slips_from_mm(bench: Bench) -> float:
    """Return the slide per step at which the robot slips, mm; NaN if it cannot be measured."""
    slides = [median_up(bench.walks(*walk), 'slide_mm') for walk in thesis.UNSLIPPED]
    return max(thesis.SLIPS * float(pd.Series(slides).max(skipna=False)), thesis.VISIBLE_SLIDE_MM)


def trend_row(published: thesis.ThesisTrend, bench: Bench) -> Row:
    """Compare a quantity over walks at the inclinations of the thesis.

    Returns:
        A record with ``name``, the statement of the thesis; ``source``, ``criterion`` in words;
        ``quantity``: slide (mm), vibration, amplitude (rad/s) or line (Hz); ``inclination_deg``,
        the steepest; ``values``, one for each walk (None if the robot does not stay up with most
        seeds); ``lost``, the walks in which it does not.
    """
    runs = [bench.walks(*walk) for walk in published.walks]
    values = [
        median_up(each, COLUMNS[published.quantity]) if share_up(each) > 0.5 else nan
        for each in runs
    ]
    line = published.quantity == 'line'
    least = thesis.LINE_HZ if line else published.least * values[0]
    grown = grows(values) and grows((values[0], values[-1]), least)
    by = f'{thesis.LINE_HZ:g} Hz' if line else f'{published.least:.0%} of the first'
    return row(
        5,
        kind_of(published.fitted),
        grown if bench.seeds >= ENOUGH else None,
        name=published.name,
        source=published.source,
        criterion=f'grows from value to value, in all by {by}',
        quantity=published.quantity,
        inclination_deg=max(phi for _, phi in published.walks),
        values=values,
        lost=[
            f'{condition.title.removeprefix("walk, ")} at {phi:g} deg'
            for (condition, phi), each in zip(published.walks, runs, strict=True)
            if share_up(each) <= 0.5
        ],
    )


def _differences(
    published: thesis.ThesisWalk, walks: pd.DataFrame, slips_from_mm: float
) -> Iterator[str]:
    """Yield in words how walks differ from the published one."""
    survives = share_up(walks) > 0.5
    if published.survives is not None and survives != published.survives:
        yield 'does not stay up' if published.survives else 'stays up'
        return
    if published.dominated and not _most(walks['dominated']):
        yield 'less power above 4 Hz than below'
    if published.slid_first and not _most(walks['slid_first']):
        yield 'tips without sliding before'
    if not survives:
        return
    slide, vibration = median_up(walks, 'slide_mm'), median_up(walks, 'vibration_rad_s')
    if published.slips is True and not slide >= slips_from_mm:
        yield f'does not slip: slides less than {slips_from_mm:.1f} mm'
    if published.slips is False and not slide < slips_from_mm:
        yield f'slips: slides {slips_from_mm:.1f} mm or more'
    if published.vibrates is not None and (vibration > VIBRATES) != published.vibrates:
        yield 'does not vibrate' if published.vibrates else 'vibrates'
    yield from _spectral_differences(published, walks[walks['stayed_up']])
    early, late = (median_up(walks, name) for name in ('early', 'late'))
    if published.alike and not late >= max(early, thesis.ALIKE_CORRELATION):
        yield 'cycles 3 and 4 are not alike'


def _spectral_differences(published: thesis.ThesisWalk, stayed: pd.DataFrame) -> Iterator[str]:
    every = [*stayed['peaks_hz']]
    for group, count in _lines(published):
        if not _most(any(_holds(of, peaks[:count]) for of in group) for peaks in every):
            yield f'{_ranges(group)} not {_place(count)}'
    if published.single and not _most(stayed['single']):
        yield 'not the single dominant peak'
    for gone in published.gone:
        if _most(_holds(gone, peaks[: thesis.SHOWN]) for peaks in every):
            yield f'still a peak in {_range(gone)}'


def _lines(published: thesis.ThesisWalk) -> list[tuple[tuple[tuple[float, float], ...], int]]:
    """Return for each published peak its accepted ranges, Hz, and its lowest accepted rank.

    A rank of n: it must be one of the n largest peaks.
    """
    groups = [published.lines] if published.either else [(each,) for each in published.lines]
    counts = [1 if published.dominant else thesis.SHOWN, *[thesis.SHOWN] * len(groups)]
    return [*zip(groups, counts, strict=False)] if published.lines else []


def _place(count: int) -> str:
    return 'the largest peak' if count == 1 else f'among the {count} largest'


def _holds(of: tuple[float, float], peaks: Sequence[float]) -> bool:
    return any(of[0] <= frequency <= of[1] for frequency in peaks)


def _range(of: tuple[float, float]) -> str:
    return f'{of[0]:.2f} to {of[1]:.2f} Hz'


def _ranges(group: Sequence[tuple[float, float]]) -> str:
    return ' or '.join(map(_range, group))


def _most(seen: Iterable[bool]) -> bool:
    found = list(seen)
    return 2 * sum(found) > len(found)
