"""The origin of the spectral lines as a page: tables, and what the runs say in words."""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import degrees, isnan
from pathlib import Path

import numpy as np

from khr_analysis.cycle_spectrum import HIGHEST, Walks
from khr_analysis.line_chance import chance_within, places
from khr_analysis.models.thesis import GAIT_PERIOD
from khr_analysis.origin import RULE, Line
from khr_common.files import write_text
from khr_common.markdown import table
from khr_experiments.experiments import Runs
from khr_experiments.peak_origin import (
    PEAK,
    PUBLISHED,
    Band,
    Settled,
    bands_of,
    explained,
    fallen_of,
    published_places,
    run_variants,
    settle,
    walks_of,
)
from khr_experiments.published import LINE_HZ
from khr_experiments.sweeps import check_workers
from khr_report.errors import ReportError

SPAN = 11.0  # Hz, in which a control frequency might lie
NEAR = 0.05  # lines, the distance of which the chance is told


def lines_markdown(runs: Runs) -> str:
    """Tell where the peaks of a walk come from, as Markdown.

    Args:
        runs: of the experiment ``lines``, or of its cases on another scenario.

    Raises:
        ReportError: if no walk survived.
    """
    walks = walks_of(runs)
    lines, bands = explained(walks), bands_of(walks)
    settled = [settle(peak, walks, bands) for peak in PUBLISHED]
    return '\n'.join(
        (
            _lead(settled),
            f'## The peaks of {runs[0].scenario.name}, {walks[0].label}\n',
            _peaks(walks, lines),
            '## Between the lines\n',
            _between(walks, bands),
            "## The thesis's four control frequencies\n",
            _published(settled),
            _chance(),
            '## Evidence\n',
            _evidence(lines),
            f'Runs that fell and are left out: {fallen_of(runs)}.\n',
        )
    )


def _lead(settled: Sequence[Settled]) -> str:
    told = '; '.join(
        f'**{each.peak.frequency:.2f} Hz** ({each.peak.gains}): {each.verdict} ({each.sure})'
        for each in settled
    )
    return (
        'What the published control frequencies are on the simulated robot, and how sure that '
        f'is: {told}.\n'
    )


def tell(scenario: str, fast: bool, workers: int | None = None, out: Path | None = None) -> str:
    """Run the variants of a scenario and tell where its peaks come from, as Markdown.

    Args:
        scenario: file or name of a walk.
        fast: one seed.
        workers: processes; as many as there are cores by default.
        out: file that the text is written to as well.

    Raises:
        ReportError: if the scenario is not accepted, no walk survived, or the file cannot be
            written.
        RunError: if the computation could not go on; what is finished is kept.
    """
    check_workers(workers)
    text = lines_markdown(run_variants(scenario, fast, workers or os.cpu_count() or 1))
    if out is not None:
        try:
            write_text(out, text)
        except OSError as error:
            raise ReportError(
                f'--out: {str(out)!r}: {error.strerror}; accepted: a file that can be written'
            ) from error
    return text


def _amplitude(value: float) -> str:
    return f'{degrees(value):.2f}'


def _within(line: Line) -> str:
    text = _amplitude(line.amplitude)
    return (
        text
        if isnan(line.low)
        else (f'{text} ({_amplitude(line.low)} to {_amplitude(line.high)})')
    )


def _peaks(walks: Sequence[Walks], lines: Sequence[Line]) -> str:
    base = walks[0]
    width = base.frequency[1]
    of_gait = sum(line.origin == 'gait' for line in lines)
    if not lines:
        return 'The spectrum has no peak.\n'
    strongest = max(lines, key=lambda line: line.amplitude)
    text = (
        f'{base.cycles} whole cycles of {base.treatment.cycle_period:g} s resolve '
        f'{width:.3f} Hz; seeds: {len(base.records)}. {of_gait} of {len(lines)} peaks from '
        f'{PEAK:.0%} of the largest on come from the gait; the largest is {strongest.label} '
        f"at {strongest.frequency:.2f} Hz. {base.repeating_share():.1%} of the pitch rate's "
        f'variance up to {HIGHEST:g} Hz lies on lines of the gait (chance: '
        f'{1.0 / base.cycles:.0%}). Second method, averaging over cycles: the last column.\n'
    )
    rows = [
        (
            f'{line.frequency:.2f}',
            f'{line.order:.2f}',
            _within(line),
            line.label,
            line.sure,
            f'{line.locked:.0%}',
        )
        for line in lines
    ]
    return '\n'.join(
        (
            text,
            table(
                ('Hz', 'n = f T', 'amplitude, deg/s (95 %)', 'origin', 'how sure', 'repeats'), rows
            )
            + '\n',
            f'How sure: {RULE}. A peak anywhere is on a line, by the resolution, with a chance of '
            f'{chance_within(0.5 / base.cycles):.0%}.\n',
        )
    )


def _between(walks: Sequence[Walks], bands: Sequence[Band]) -> str:
    found = [band for band in bands if band.found is not None]
    without = [band.more.label for band in bands if band.found is None]
    text = (
        'A loop near its limit rings at every step with another phase. That makes no line: '
        'it fills a band between the lines. Bands whose amplitude at least doubles when the '
        'gain of one loop is raised:\n'
    )
    if not found:
        return f'{text}\nnone.\n'
    return '\n'.join(
        (
            text,
            table(
                (
                    'raised',
                    'from',
                    'loop',
                    'most at, Hz',
                    'half of it, Hz',
                    'there, deg/s',
                    'before, deg/s',
                    'every seed',
                ),
                [
                    (
                        band.more.label,
                        band.less.label,
                        band.loop,
                        f'{each.frequency:.2f}',
                        f'{each.low:.1f} to {each.high:.1f}',
                        _amplitude(each.amplitude),
                        _amplitude(each.before),
                        'yes' if each.beyond else 'no',
                    )
                    for band in found
                    if (each := band.found)
                ],
            )
            + '\n',
            f'No such band: {", ".join(without) or "none"}.\n',
        )
    )


def _published(settled: Sequence[Settled]) -> str:
    rows = []
    for each in settled:
        at = places([each.peak.frequency], GAIT_PERIOD, LINE_HZ).orders[0]
        here = (
            '-'
            if each.line is None or each.walks is None
            else (
                f'{each.line.frequency:.2f} Hz, {each.share:.0%} of the largest '
                f'({each.walks.label})'
            )
        )
        rows.append(
            (
                f'{each.peak.frequency:.2f}',
                each.peak.gains,
                f'{at:.2f}',
                here,
                f'{len(each.holding)} of {len(each.bands)}',
                each.verdict,
                each.sure,
            )
        )
    heads = (
        'published, Hz',
        'with',
        'n = f T',
        f'strongest within {LINE_HZ:g} Hz here',
        'comparisons with a ringing band that holds it',
        'verdict on the simulated robot',
        'how sure',
    )
    return '\n'.join((table(heads, rows) + '\n', _rule(settled)))


def _rule(settled: Sequence[Settled]) -> str:
    bands = {band for each in settled for band in each.bands}  # of a loop they are the same
    widths = [band.found.high - band.found.low for band in bands if band.found]
    text = (
        f'From {PEAK:.0%} of the largest on the verdict is the label of the line there, as '
        'above, with low sureness where the loop rings too; a line whose experiments tie '
        'settles nothing. Below that nothing stands out, and the verdict is control if a '
        'loop rings there: medium if more than half of two or more comparisons have a band '
        'that holds the frequency, else low.'
    )
    if widths:
        text += (
            f' A band is {np.mean(widths):.1f} Hz wide on average: of the frequencies up to '
            f'{SPAN:g} Hz, chance puts {np.mean(widths) / SPAN:.0%} into it.'
        )
    return f'{text}\n'


def _chance() -> str:
    found = published_places()
    near = ', '.join(f'{distance:.2f}' for distance in found.distances)
    text = (
        f'The places alone: the four lie {near} from a whole n. A frequency drawn anywhere '
        f'lies within {NEAR:g} of one with a chance of {chance_within(NEAR):.0%}; four drawn '
        f'anywhere lie as near in sum with a chance of {found.probability:.0%}.'
    )
    if not found.tells:
        text += (
            f' But a published peak is known to +-{LINE_HZ:g} Hz, +-{found.error:.2f} lines: '
            'a line read that way may be found anywhere between two, and any other '
            'frequency on one, so this test has no power and the published numbers alone '
            'decide nothing. (The bins of a spectrum of one cycle are the lines.) For the '
            'real robot the verdicts above hold as far as the simulated one is like it.'
        )
    return f'{text}\n'


def _evidence(lines: Sequence[Line]) -> str:
    return (
        '\n'.join(
            f'- {line.frequency:.2f} Hz, {line.label}: '
            + '; '.join(f'{each.experiment}: {each.words}' for each in line.evidence)
            for line in lines
        )
        + '\n'
    )
