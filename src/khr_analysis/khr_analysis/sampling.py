"""Samples on an even grid of time, from the timestamps of any recording.

A spectrum needs samples at even intervals. Recordings have timestamps that jitter, repeat, come in
batches, jump or are missing. The rate is found from them, the longest stretch without a gap is
used, and every correction is stated.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.optimize import isotonic_regression

from khr_common.errors import KhrError
from khr_common.signals import GAP
from khr_common.stamps import SYSTEM_TIME

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]

LEAST = 8  # samples of a spectrum
DISORDER = 3.0  # periods that a timestamp may be behind its predecessor: messages were swapped
YEAR = 3.15e16  # ns: a longer step is a change of the clock
EVEN = 0.05  # of a period, standard deviation of timestamps that count as even
LOST = 0.2  # share of missing samples above which intervals do not count as losses
CROWDED, BATCHED = 0.25, 0.3  # of the mean interval, and share of intervals below, of batches
# of the mean interval, and of their mean, above and within which short intervals are those of a
# sensor that measures in bursts: messages that waited for one another come faster or unevenly
BURST, ALIKE = 0.02, 0.1
NEAR = 0.25  # of a period, within which all intervals are whole ones: each is counted by itself
FOLLOWED = 0.1  # of the delay of a timestamp, by which the grid that places are read on shifts
ROUNDING = 0.01  # of a period, by which a time on the grid may be off
MOST = 20_000_000  # samples of a grid


@dataclass(frozen=True, eq=False)
class Samples:
    """A stretch of a signal, sampled evenly."""

    start: float  # time of the first sample, s; system time counts from its first timestamp
    period: float  # between the samples, s
    values: Array  # (N,)
    highest: float  # frequency that is shown, Hz; the Nyquist frequency unless resampled
    notes: tuple[str, ...]  # on rate and corrections, a sentence each

    @property
    def times(self) -> Array:
        """Return the time of each sample, s, (N,)."""
        return np.asarray(self.start + self.period * np.arange(len(self.values)))

    @property
    def resampled(self) -> bool:
        """Return whether the timestamps are too uneven to be taken for a grid."""
        return 2.0 * self.highest * self.period < 1.0 - ROUNDING

    @property
    def span(self) -> tuple[float, float]:
        """Return begin and end, s; the last sample lasts one period."""
        return self.start, self.start + self.period * len(self.values)


def choose_stamps(headers: Stamps, logs: Stamps) -> tuple[Stamps, list[str]]:
    """Return the timestamps to use, ns, and notes on the choice.

    Args:
        headers: timestamps of the messages, ns, (N,); zero where a message has none.
        logs: times of recording, ns, (N,).
    """
    zero = 2 * np.count_nonzero(headers) < len(headers)
    if len(headers) < 2 or not (zero or len(np.unique(headers)) <= max(1, len(headers) // 20)):
        return headers, []
    given = 'zero' if zero else 'constant'
    return logs, [f'The timestamps of the messages are {given}: the times of recording are used.']


def even_samples(stamps: Stamps, values: Array) -> Samples:
    """Return the longest stretch without a gap, on an even grid of time.

    Args:
        stamps: of the samples in the order of recording, ns, (N,).
        values: (N,); samples that are not finite are left out.

    Raises:
        KhrError: if no stretch has eight samples.
    """
    notes: list[str] = []
    stamps, values = _cleaned(stamps, values, notes)
    system = stamps[stamps >= SYSTEM_TIME]
    first, last = _longest(stamps, notes)
    stamps, values = stamps[first:last], values[first:last]
    if len(stamps) < LEAST:
        raise KhrError(
            f'{len(stamps)} samples in a row are not enough; accepted: {LEAST} or more at '
            'increasing times'
        )
    found = _on_grid((stamps - stamps[0]) / 1e9, values)
    before = int(stamps[0]) - (int(system[0]) if stamps[0] >= SYSTEM_TIME else 0)
    return replace(found, start=before / 1e9 + found.start, notes=(*notes, *found.notes))


def samples_at(times: Array, values: Array) -> Samples:
    """Return samples as :func:`even_samples`, from times in s; NaN marks a missing one."""
    known = np.isfinite(values)
    stamps: Stamps = np.rint(times[known] * 1e9).astype(np.int64)
    return even_samples(stamps, values[known])


def _cleaned(stamps: Stamps, values: Array, notes: list[str]) -> tuple[Stamps, Array]:
    """Leave out samples without a number or timestamp, and repeated messages."""
    finite = np.isfinite(values)
    if not finite.all():
        notes.append(f'{_count(~finite)} left out: not finite.')
    zero = stamps == 0
    unstamped = zero if 1 < zero.sum() < len(zero) else np.zeros(len(zero), bool)
    if unstamped.any():
        notes.append(f'{_count(unstamped)} left out: their timestamp is 0.')
    stamps, values = stamps[finite & ~unstamped], values[finite & ~unstamped]
    repeated = np.zeros(len(stamps), bool)
    repeated[1:] = (np.diff(stamps) == 0) & (np.diff(values) == 0.0)
    if repeated.any() and np.ptp(values) > 0.0:
        notes.append(f'{_count(repeated)} left out: repeated messages.')
        stamps, values = stamps[~repeated], values[~repeated]
    steps = np.diff(stamps)
    near = -DISORDER * (float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0)
    swapped = (steps < 0) & (steps >= near)
    if swapped.any():
        notes.append(f'{_count(swapped)} out of order and sorted.')
        for part in _parts(len(stamps), np.flatnonzero((steps < near) | (steps > YEAR)) + 1):
            order = np.argsort(stamps[part], kind='stable')
            stamps[part], values[part] = stamps[part][order], values[part][order]
    return stamps, values


def _longest(stamps: Stamps, notes: list[str]) -> tuple[int, int]:
    """Return start and end of the longest stretch of timestamps without a gap."""
    steps = np.diff(stamps).astype(np.float64)
    forward = steps[(steps > 0) & (steps < YEAR)]
    if not len(forward):
        return 0, 0
    jump = (steps < 0) | (steps > YEAR)
    gap = ~jump & (steps > GAP * _usual(forward))
    cuts = np.flatnonzero(jump | gap) + 1
    if not len(cuts):
        return 0, len(stamps)
    parts = _parts(len(stamps), cuts)
    longest = max(parts, key=lambda part: (part.stop - part.start, -part.start))
    for what, found in (('gap', gap), ('jump', jump)):
        if found.any():
            widest = int(np.argmax(np.where(found, np.abs(steps), -1.0)))
            number = int(found.sum())
            notes.append(
                f'The timestamps have {number} {what}{"s" * (number > 1)}, the '
                f'{"longest" if what == "gap" else "largest"} of {_seconds(steps[widest])} after '
                f'{_seconds(float(stamps[widest] - stamps[parts[0].start]))}.'
            )
    kept = longest.stop - longest.start
    notes.append(f'The longest stretch without them is used: {kept} of {len(stamps)} samples.')
    return longest.start, longest.stop


def _usual(forward: Array) -> float:
    """Return the interval between two samples, or between two batches of samples, ns."""
    median = float(np.median(forward))
    mean = float(np.mean(forward[forward <= np.percentile(forward, 99)]))
    crowded = _share_in_batches(forward, mean)
    return float(np.percentile(forward, 95)) if crowded > BATCHED else max(median, 1.0)


def _share_in_batches(steps: Array, mean: float) -> float:
    """Return the share of steps within batches: of messages that waited for one another.

    It is 0 for bursts, whose samples were measured evenly, with pauses between them.
    """
    short = steps[steps < CROWDED * mean]
    usual = float(np.median(short)) if len(short) and short.min() > 0.0 else 0.0
    if usual > BURST * mean and np.mean(np.abs(short / usual - 1.0) > ALIKE) < ALIKE:
        return 0.0
    return len(short) / len(steps)


def _count(chosen: NDArray[np.bool_]) -> str:
    number = int(np.count_nonzero(chosen))
    return f'{number} sample{"" if number == 1 else "s"}'


def _seconds(interval_ns: float) -> str:
    seconds = interval_ns / 1e9
    return f'{seconds:.3g} s' if abs(seconds) < 1e3 else f'{seconds:.0f} s'


def _parts(count: int, cuts: NDArray[np.intp]) -> list[slice]:
    bounds = [0, *cuts.tolist(), count]
    return [slice(start, stop) for start, stop in pairwise(bounds)]


def _on_grid(times: Array, values: Array) -> Samples:
    """Return samples on an even grid; ``start`` is relative to the first timestamp."""
    steps = np.diff(times)
    mean = float(times[-1]) / len(steps)
    if not mean > 0.0:
        raise KhrError('timestamps that do not increase are not enough; accepted: increasing ones')
    crowded = _share_in_batches(steps, mean)
    places = np.arange(len(times))
    period, start, off = _fit(places, times)
    if crowded <= BATCHED:
        found = _places(times)
        fit = _fit(found, times)
        if found[-1] + 1 - len(found) <= LOST * len(steps) and np.std(fit[2]) < np.std(off):
            places, (period, start, off) = found, fit
    spread, worst = float(np.std(off)), float(np.max(np.abs(off)))
    missing = int(places[-1]) + 1 - len(places)
    rate = f'{len(values)} samples, {1.0 / period:.5g} Hz by the timestamps'
    if crowded > BATCHED:
        notes = [
            f'{rate}; they come in batches of about {1.0 / (1.0 - crowded):.0f} and are spread '
            'evenly: if they were measured when they are stamped, all frequencies are wrong.'
        ]
    elif spread <= EVEN or period * worst < 2e-9:
        notes = [f'{rate}, which are even within {max(100.0 * worst, 0.1):.2g} % of a period.']
    else:
        return _resampled(times, values, spread)
    if missing:
        notes.append(f'{missing} missing sample{"s" * (missing > 1)} interpolated.')
        grid = np.arange(places[-1] + 1)
        values = np.asarray(CubicSpline(places, values)(grid))
    return Samples(start, period, values, 0.5 / period, tuple(notes))


def _fit(places: NDArray[np.int64], times: Array) -> tuple[float, float, Array]:
    """Return period and start of the even grid of samples at these places, s.

    The third value is how far each is off the grid, in periods.
    """
    fitted, start = np.polyfit(places, times, 1)
    period = round(fitted, 9) if abs(fitted - round(fitted, 9)) < 1e-13 else float(fitted)
    return period, float(start), (times - start) / period - places


def _places(times: Array) -> NDArray[np.int64]:
    """Return the number of each sample, counted from the first; missing samples count as well.

    A late timestamp is no missing sample: each is placed on a grid that follows all of them, and
    not by its distance from the one before.
    """
    steps = np.diff(times)
    usual = float(np.median(steps[steps > 0.0]))
    whole = np.maximum(1, np.rint(steps / usual))
    if np.max(np.abs(steps / usual - whole)) > NEAR:
        single = steps[(steps > 0.5 * usual) & (steps < 1.5 * usual)]
        period = float(np.mean(single)) if len(single) else usual
        due, place, found = 0.0, 0, []
        for time in times.tolist():
            number = round((time - due) / period)
            place += number
            due += number * period
            late = time - due
            found.append(place + late / period)
            due += FOLLOWED * late
            period += FOLLOWED**2 / 4.0 * late
        index = np.arange(len(found))
        missing = np.rint(isotonic_regression(np.array(found) - index).x)  # never fewer again
        whole = np.diff(missing + index)
    return np.concatenate([[0], np.cumsum(whole)]).astype(np.int64)


def _resampled(times: Array, values: Array, spread: float) -> Samples:
    """Interpolate samples at uneven times, finely enough to avoid aliasing.

    Args:
        times: from 0 on, s, (N,).
        values: (N,).
        spread: standard deviation of the times from an even grid, in periods of it.
    """
    count = len(values)
    mean = float(times[-1]) / (count - 1)
    times, values = _apart(times, values, CROWDED * mean)
    steps = np.diff(times)
    short, long = (float(each) for each in np.percentile(steps, (5, 95)))
    period = float(np.clip(short, mean / 10.0, mean))
    size = int((times[-1] - times[0]) / period + 1e-9) + 1
    if size > MOST:
        raise KhrError(f'{size} samples are too many; accepted: at most {MOST}')
    highest = 0.5 / long
    uneven = f'jitter by {100.0 * spread:.0f} % of a period'
    if spread > 1.0:
        uneven = f'come at intervals of {1e3 * short:.3g} to {1e3 * long:.3g} ms (5 to 95 %)'
    merged = count - len(values)
    together = f' {merged} that follow another at once are averaged with it.' if merged else ''
    note = (
        f'{count} samples, {1.0 / mean:.5g} Hz on average by the timestamps, which {uneven}: '
        f'resampled evenly at {1.0 / period:.5g} Hz by cubic splines.{together} The spectrum ends '
        f'at {highest:.4g} Hz, half the rate of the longer intervals (5 % are longer still), below '
        f'half the mean rate, {0.5 / mean:.4g} Hz.'
    )
    grid = times[0] + period * np.arange(size)
    even = np.asarray(CubicSpline(times, values)(grid))
    return Samples(float(times[0]), period, even, highest, (note,))


def _apart(times: Array, values: Array, least: float) -> tuple[Array, Array]:
    """Return the means of samples less than ``least`` apart, s: a spline would overshoot there."""
    first = [0]
    for index, (before, time) in enumerate(pairwise(times.tolist()), start=1):
        if time - before >= least or time - times[first[-1]] > 2.0 * least:
            first.append(index)
    count = np.diff([*first, len(times)])
    return np.add.reduceat(times, first) / count, np.add.reduceat(values, first) / count


def within(samples: Samples, begin: float = -inf, end: float = inf) -> Samples:
    """Return the samples at times of ``begin`` and later, and before ``end``, s."""
    little = ROUNDING * samples.period
    times = samples.times
    inside = (times > begin - little) & (times < end - little)
    start = float(times[inside][0]) if inside.any() else samples.start
    return replace(samples, start=start, values=samples.values[inside])
