"""The origin of the spectral peaks as a document."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from math import degrees, isnan
from pathlib import Path

import numpy as np

from khr_analysis.cycle_spectrum import HIGHEST
from khr_analysis.line_chance import chance_within, places
from khr_analysis.models.thesis import GAIT_PERIOD
from khr_analysis.null_rates import null_rates
from khr_analysis.origin import RULE, Line
from khr_common.files import write_text
from khr_experiments.peak_origin import (
    PEAK,
    Band,
    PeakOrigin,
    PeakStudy,
    Settled,
    published_places,
    run_variants,
    study,
)
from khr_experiments.published import LINE_HZ
from khr_report.page.document import Block, Bullets, Columns, Passage, markdown, table
from khr_sweeps.sweep import check_workers

SPAN = 11.0  # Hz, in which a control frequency might lie
NEAR = 0.05  # distance from a line, in lines, whose chance is given


def blocks(found: PeakStudy) -> list[Block]:
    """Return the document on the origin of the peaks of a walk."""
    base = found.walks[0]
    return [
        _lead(found.origins),
        Passage(f'The peaks of {found.scenario}, {base.label}', _peaks(found)),
        Passage('Between the lines', _between(found.bands)),
        Passage("The thesis's four control frequencies", _published(found.published)),
        Passage('Evidence', _evidence(found.lines)),
        f'Runs that fell and are left out: {found.fallen}.',
    ]


def peak_origin(
    scenario: str,
    fast: bool,
    workers: int | None = None,
    out: Path | None = None,
    changed: Sequence[str] = (),
) -> str:
    """Run the variants of a scenario and return the origin of its peaks as Markdown.

    Args:
        scenario: file or name of a walk.
        fast: one seed.
        workers: processes; as many as there are cores by default.
        out: file that the text is written to as well.
        changed: parameters to change in all variants, each ``node.parameter=value``.

    Raises:
        ExperimentError: if the scenario is not accepted, or no walk survived.
        KhrError: if the file cannot be written.
        RunError: if the computation could not go on; what is finished is kept.
    """
    check_workers(workers)
    runs = run_variants(scenario, fast, workers or os.cpu_count() or 1, changed=changed)
    text = markdown(blocks(study(runs))) + '\n'
    if out is not None:
        write_text(out, text)
    return text


def _lead(origins: Sequence[PeakOrigin]) -> str:
    listed = '; '.join(
        f'{each.frequency:.2f} Hz ({each.gains}): {each.verdict} ({each.sure})' for each in origins
    )
    return (
        'Origin of the published control frequencies on the simulated robot, and how sure that '
        f'is: {listed}.'
    )


def _amplitude(value: float) -> str:
    return f'{degrees(value):.2f}'


def _within(line: Line) -> str:
    text = _amplitude(line.amplitude)
    if isnan(line.low):
        return text
    return f'{text} ({_amplitude(line.low)} to {_amplitude(line.high)})'


LINE_COLUMNS: Columns[Line] = {
    'Hz': lambda line: f'{line.frequency:.2f}',
    'n = f T': lambda line: f'{line.order:.2f}',
    'amplitude, deg/s (95 %)': _within,
    'origin': lambda line: line.label,
    'how sure': lambda line: line.sure,
    'repeats': lambda line: f'{line.locked:.0%}',
}


def _peaks(found: PeakStudy) -> tuple[Block, ...]:
    base, lines = found.walks[0], found.lines
    if not lines:
        return (
            'The spectrum has no peak that stands out of what lies between its lines.',
            f'The rule: {RULE}.',
        )
    of_gait = sum(line.origin == 'gait' for line in lines)
    strongest = max(lines, key=lambda line: line.amplitude)
    return (
        f'{base.cycles} whole cycles of {base.treatment.cycle_period:g} s resolve '
        f'{base.frequency[1]:.3f} Hz; seeds: {len(base.records)}. {of_gait} of {len(lines)} peaks '
        f'of at least {PEAK:.0%} of the largest come from the gait; the largest is '
        f'{strongest.label} at {strongest.frequency:.2f} Hz. {base.repeating_share():.1%} of the '
        f"pitch rate's variance up to {HIGHEST:g} Hz lies on lines of the gait (chance: "
        f'{1.0 / base.cycles:.0%}). The last column is the share of the power that repeats in '
        'every cycle (synchronous averaging).',
        table(lines, LINE_COLUMNS),
        f'The rule: {RULE}. By the resolution, a peak anywhere is on a line with a chance of '
        f'{chance_within(0.5 / base.cycles):.0%}.',
        _null_rates(found),
    )


def _null_rates(found: PeakStudy) -> str:
    """Say how often these experiments would be wrong."""
    rates = null_rates(found.walks, PEAK)

    def counted(labels: Mapping[str, int]) -> str:
        return (
            f'{labels["gait"]} called gait, {labels["feedback"]} feedback, '
            f'{labels["slipping"]} slipping and {labels["unexplained"]} left unexplained'
        )

    return (
        f'How often that is wrong: in {rates.spectra} invented sets of walks like these, white '
        f'noise alone had {rates.noise.total()} peaks, {counted(rates.noise)}; the lines of this '
        f'gait in noise as strong as here between them had {rates.gait.total()}, '
        f'{counted(rates.gait)}.'
    )


def _between(bands: Sequence[Band]) -> tuple[Block, ...]:
    found = [(band, band.found) for band in bands if band.found is not None]
    without = [band.more.label for band in bands if band.found is None]
    text = (
        'A loop near its limit rings at every step with another phase. That makes no line: '
        'it fills a band between the lines. Bands whose amplitude at least doubles when the '
        'gain of one loop is raised:'
    )
    if not found:
        return text, 'none.'
    return (
        text,
        table(
            found,
            {
                'raised': lambda row: row[0].more.label,
                'from': lambda row: row[0].less.label,
                'loop': lambda row: row[0].loop,
                'most at, Hz': lambda row: f'{row[1].frequency:.2f}',
                'half of it, Hz': lambda row: f'{row[1].low:.1f} to {row[1].high:.1f}',
                'there, deg/s': lambda row: _amplitude(row[1].amplitude),
                'before, deg/s': lambda row: _amplitude(row[1].before),
                'every seed': lambda row: 'yes' if row[1].beyond else 'no',
            },
        ),
        f'No such band: {", ".join(without) or "none"}.',
    )


def _strongest(settled: Settled) -> str:
    if settled.line is None or settled.walks is None:
        return '-'
    return (
        f'{settled.line.frequency:.2f} Hz, {settled.share:.0%} of the largest '
        f'({settled.walks.label})'
    )


def _order(settled: Settled) -> str:
    return f'{places([settled.peak.frequency], GAIT_PERIOD, LINE_HZ).orders[0]:.2f}'


SETTLED_COLUMNS: Columns[Settled] = {
    'published, Hz': lambda row: f'{row.peak.frequency:.2f}',
    'with': lambda row: row.peak.gains,
    'n = f T': _order,
    f'strongest within {LINE_HZ:g} Hz here': _strongest,
    'comparisons with a ringing band around it': lambda row: (
        f'{len(row.holding)} of {len(row.bands)}'
    ),
    'verdict on the simulated robot': lambda row: row.verdict,
    'how sure': lambda row: row.sure,
}


def _published(settled: Sequence[Settled]) -> tuple[Block, ...]:
    return table(settled, SETTLED_COLUMNS), _rule(settled), _chance()


def _rule(settled: Sequence[Settled]) -> str:
    bands = {band for each in settled for band in each.bands}  # peaks of a loop share them
    widths = [band.found.high - band.found.low for band in bands if band.found]
    text = (
        f'From {PEAK:.0%} of the largest amplitude on, the verdict is the label of the line '
        'there, as above, with low sureness where the loop rings too; a line whose experiments '
        'do not explain it settles nothing. Below that nothing stands out, and the verdict is '
        'control if a loop rings there: medium if more than half of two or more comparisons have a band '
        'around the frequency, else low.'
    )
    if widths:
        text += (
            f' A band is {np.mean(widths):.1f} Hz wide on average: of the frequencies up to '
            f'{SPAN:g} Hz, {np.mean(widths) / SPAN:.0%} lie in it by chance.'
        )
    return text


def _chance() -> str:
    found = published_places()
    near = ', '.join(f'{distance:.2f}' for distance in found.distances)
    text = (
        f'The frequencies alone: the four lie {near} from a whole n. A random frequency lies '
        f'within {NEAR:g} of one with a chance of {chance_within(NEAR):.0%}; four random ones '
        f'lie as near in sum with a chance of {found.probability:.0%}.'
    )
    if not found.decisive:
        text += (
            f' But a published peak is known to +-{LINE_HZ:g} Hz, +-{found.error:.2f} lines: '
            'a line read that way may be found anywhere between two, and any other '
            'frequency on one, so this test has no power and the published numbers alone '
            'decide nothing. (The bins of a spectrum of one cycle are the lines.) For the '
            'real robot the verdicts above hold as far as the simulated one is like it.'
        )
    return text


def _evidence(lines: Sequence[Line]) -> tuple[Block, ...]:
    return (
        Bullets(
            tuple(
                f'{line.frequency:.2f} Hz, {line.label}: '
                + '; '.join(f'{each.experiment}: {each.words}' for each in line.evidence)
                for line in lines
            )
        ),
    )
