"""The document on the origin of the spectral peaks."""

from __future__ import annotations

from collections.abc import Sequence
from math import isnan

import numpy as np

from khr_analysis.peaks import Peak
from khr_common.published import GAIT_PERIOD
from khr_report.page.document import Columns, bullets, markdown, page_text, rate, table
from khr_studies.measuring.thesis_values import LINE_HZ
from khr_studies.peak_origin import origin
from khr_studies.peak_origin.cycle_spectrum import HIGHEST
from khr_studies.peak_origin.origin import Line
from khr_studies.peak_origin.study import PeakStudy, RecordedPeaks
from khr_studies.peak_origin.thesis_peaks import (
    THESIS_PEAKS,
    Band,
    JudgedPeak,
    chance_of_distances,
    distances_from_lines,
)

SPAN = 11.0  # Hz, range of possible control frequencies
LINE_DISTANCE = 0.05  # distance from a line, in lines


def blocks(found: PeakStudy) -> list[str]:
    """Return the document on the origin of the peaks of a walk."""
    bands = {band for each in found.judged for band in each.bands}  # peaks of a loop share them
    distances = distances_from_lines([peak.frequency for peak in THESIS_PEAKS], GAIT_PERIOD)
    widths = [band.found.high - band.found.low for band in bands if band.found]
    return [
        page_text(
            __name__,
            found=found,
            base=found.walks[0],
            of_gait=sum(line.origin == 'gait' for line in found.lines),
            strongest=max(found.lines, key=lambda line: line.amplitude, default=None),
            lines=table(found.lines, LINE_COLUMNS),
            bands=_bands(found.bands),
            without=[band.more.label for band in found.bands if band.found is None],
            judged=table(found.judged, JUDGED_COLUMNS),
            width=np.mean(widths) if widths else None,
            distances=distances,
            chance=chance_of_distances(distances),
            error=LINE_HZ * GAIT_PERIOD,
            evidence=_evidence(found.lines),
            origin=origin,
            highest=HIGHEST,
            span=SPAN,
            near=LINE_DISTANCE,
            line_hz=LINE_HZ,
        ),
        f'Dropped runs, in which the robot did not stay up: {found.lost}.',
    ]


def page(found: PeakStudy) -> str:
    """Return the document in Markdown."""
    return markdown(blocks(found)) + '\n'


def recorded_page(found: RecordedPeaks) -> str:
    """Return the peaks of one recording as a table in Markdown, and the notes on it."""
    part = f'{round(found.begin, 2) + 0.0:.2f} s to {found.end:.2f} s'
    largest = max((peak.amplitude for peak in found.peaks), default=1.0)
    columns: Columns[Peak] = {
        'frequency, Hz': lambda peak: f'{peak.frequency:.2f}',
        f'amplitude, {found.unit}': lambda peak: f'{peak.amplitude:.4g}',
        'of the largest': lambda peak: f'{100.0 * peak.amplitude / largest:.0f} %',
        'place': found.place,
    }
    texts: list[str] = [
        f'{found.run}: {found.signal}, from {part}.',
        table(found.peaks, columns) if found.peaks else 'No line stands out of the noise.',
        bullets(found.notes),
    ]
    if found.cycle:
        texts.append(
            'One run does not show the origin of a peak between the lines of its gait: `khr lines` '
            'with a scenario compares walks with other gains, cycles and friction in the simulator.'
        )
    return markdown(texts) + '\n'


def _within(line: Line) -> str:
    text = rate(line.amplitude, 2)
    return text if isnan(line.low) else f'{text} ({rate(line.low, 2)} to {rate(line.high, 2)})'


LINE_COLUMNS: Columns[Line] = {
    'Hz': lambda line: f'{line.frequency:.2f}',
    'n = f T': lambda line: f'{line.order:.2f}',
    'amplitude, deg/s (95 %)': _within,
    'origin': lambda line: line.label,
    'how sure': lambda line: line.sure,
    'repeats': lambda line: f'{line.locked:.0%}',
}


def _bands(bands: Sequence[Band]) -> str:
    return table(
        [(band, band.found) for band in bands if band.found is not None],
        {
            'raised': lambda row: row[0].more.label,
            'from': lambda row: row[0].less.label,
            'loop': lambda row: row[0].loop,
            'most at, Hz': lambda row: f'{row[1].frequency:.2f}',
            'half of it, Hz': lambda row: f'{row[1].low:.1f} to {row[1].high:.1f}',
            'there, deg/s': lambda row: rate(row[1].amplitude, 2),
            'before, deg/s': lambda row: rate(row[1].before, 2),
            'every seed': lambda row: 'yes' if row[1].beyond else 'no',
        },
    )


def _strongest(judged: JudgedPeak) -> str:
    if judged.line is None or judged.walks is None:
        return '-'
    return (
        f'{judged.line.frequency:.2f} Hz, {judged.share:.0%} of the largest ({judged.walks.label})'
    )


JUDGED_COLUMNS: Columns[JudgedPeak] = {
    'published, Hz': lambda row: f'{row.peak.frequency:.2f}',
    'with': lambda row: row.peak.gains,
    'n = f T': lambda row: f'{row.peak.frequency * GAIT_PERIOD:.2f}',
    f'strongest within {LINE_HZ:g} Hz here': _strongest,
    'comparisons with a ringing band around it': lambda row: (
        f'{len(row.ringing)} of {len(row.bands)}'
    ),
    'verdict on the simulated robot': lambda row: row.verdict,
    'how sure': lambda row: row.sure,
}


def _evidence(lines: Sequence[Line]) -> str:
    return bullets(
        f'{line.frequency:.2f} Hz, {line.label}: '
        + '; '.join(f'{name}: {each.words}' for name, each in line.evidence.items())
        for line in lines
    )
