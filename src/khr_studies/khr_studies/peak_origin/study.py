"""``khr lines``: attribute a walk's spectral peaks to gait, feedback or slipping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby, product
from math import radians
from pathlib import Path

import numpy as np

from khr_balance.ankle import AnkleControllerParameters
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.hip import HipControllerParameters
from khr_bringup.scenario.scenario import changes_of, load_scenario
from khr_common.published import GAIT_PERIOD
from khr_common.text.strict_yaml import read_yaml
from khr_sim.run_parameters import RunParameters
from khr_studies.errors import StudyError
from khr_studies.measuring.experiments import Run, Runs, run_sweeps, runs_of, shipped
from khr_studies.measuring.published import LINE_HZ
from khr_studies.peak_origin.cycle_spectrum import Record, Treatment, Walks
from khr_studies.peak_origin.line_chance import Places, places
from khr_studies.peak_origin.null_rates import NullRates, null_rates
from khr_studies.peak_origin.origin import Line, Sureness, origins, strongest_near
from khr_studies.peak_origin.resonance import Resonance, resonance
from khr_sweeps.axes import CASE
from khr_sweeps.pool import check_workers
from khr_sweeps.reading import sweep_from
from khr_sweeps.trial import identity

EXPERIMENT = 'lines'
ROOT = Path('runs/lines')
PEAK = 0.1  # smallest amplitude of a peak, over the largest one
NEAR = (0.9, 2.0)  # range of gains that are compared with a published one, as a factor of it


@dataclass(frozen=True)
class PublishedPeak:
    """A peak that Dutta (2021) calls a control frequency, Hz, and the gains of its walk."""

    frequency: float
    ankle_gain: float
    hip_gain: float = 0.0

    @property
    def gains(self) -> str:
        """Name the gains."""
        return f'K_A {self.ankle_gain:g}' + (f', K_H {self.hip_gain:g}' if self.hip_gain else '')


PUBLISHED = (
    PublishedPeak(2.58, 12.0),
    PublishedPeak(4.74, 18.0),
    PublishedPeak(7.33, 12.0, 13.0),
    PublishedPeak(8.40, 12.0, 14.0),
)  # the thesis does not say which K_H belongs to 7.33 Hz; 13 is our reading


@dataclass(frozen=True)
class Band:
    """A band between the gait's lines that grows when the gain of one loop is raised.

    Attributes:
        less, more: walks on the same ground, with less and with more gain.
        found: the band; None if the walks do not differ there.
    """

    less: Walks
    more: Walks
    found: Resonance | None

    @property
    def loop(self) -> str:
        """Name the gain that was raised."""
        return 'hip' if self.more.treatment.hip_gain > self.less.treatment.hip_gain else 'ankle'


@dataclass(frozen=True)
class PeakOrigin:
    """The origin of a published peak on the simulated robot, in words, and how sure it is."""

    frequency: float
    gains: str
    verdict: str
    sure: Sureness


@dataclass(frozen=True)
class Settled:
    """The evidence on a published peak.

    Attributes:
        walks: with its gains, on the steepest ground on which they stay up; None if there are none.
        line: the strongest bin within the reading error of the peak.
        share: its amplitude over the largest one.
        bands: comparisons of the peak's loop at gains near the published one.
        verdict: in words.
    """

    peak: PublishedPeak
    walks: Walks | None
    line: Line | None
    share: float
    bands: tuple[Band, ...]
    verdict: str
    sure: Sureness

    @property
    def origin(self) -> PeakOrigin:
        """Return the result without the evidence."""
        return PeakOrigin(self.peak.frequency, self.peak.gains, self.verdict, self.sure)

    @property
    def holding(self) -> tuple[Band, ...]:
        """Return the bands that contain the published frequency."""
        return tuple(
            band for band in self.bands if band.found and band.found.holds(self.peak.frequency)
        )


@dataclass(frozen=True)
class PeakStudy:
    """The spectral peaks of a walk and their origin.

    Attributes:
        scenario: the walk.
        walks: its records, then those of its variants.
        lines: the peaks of the first walks.
        bands: between the lines.
        published: the evidence on the published peaks.
        lost: the runs that did not stay up and are left out, in words.
        rates: how often such experiments are wrong.
    """

    scenario: str
    walks: tuple[Walks, ...]
    lines: tuple[Line, ...]
    bands: tuple[Band, ...]
    published: tuple[Settled, ...]
    lost: str
    rates: NullRates

    @property
    def origins(self) -> tuple[PeakOrigin, ...]:
        """Return the origin of the published peaks."""
        return tuple(each.origin for each in self.published)


def walks_of(runs: Runs) -> tuple[Walks, ...]:
    """Return the records of each case's runs that stayed up over the whole cycles of the gait.

    Raises:
        StudyError: if no run stayed up, or none kept its signals.
    """
    found = []
    for label, group in groupby(runs, key=lambda run: str(run.point.get(CASE, ''))):
        kept = [run for run in group if run.stayed_up and run.series]
        if kept:
            found.append(_walks(label, kept))
    if not found:
        raise StudyError('lines: no walk stayed up; accepted: a scenario that the robot walks')
    return tuple(found)


def lost_of(runs: Runs) -> str:
    """List how many runs of each case did not stay up and are left out."""
    counts = {
        label: [run.row['stayed_up'] is False for run in group]
        for label, group in groupby(runs, key=lambda run: str(run.point.get(CASE, '')))
    }
    return (
        ', '.join(
            f'{label} ({sum(lost)} of {len(lost)})' for label, lost in counts.items() if any(lost)
        )
        or 'none'
    )


def _walks(label: str, runs: Sequence[Run]) -> Walks:
    scenario = runs[0].scenario
    simulator, gait = scenario.table(RunParameters), scenario.table(GaitParameters)
    ankle = scenario.table(AnkleControllerParameters)
    hip = scenario.table(HipControllerParameters)
    treatment = Treatment(
        gait.cycle_period,
        ankle.gain if ankle.enabled else 0.0,
        hip.gain if hip.enabled else 0.0,
        simulator.sole_friction,
        radians(simulator.inclination_deg),
    )
    start, end = whole_cycles(gait)
    return Walks(
        label, treatment, tuple(_record(run, start, end) for run in runs), simulator.control_period
    )


def whole_cycles(gait: GaitParameters) -> tuple[float, float]:
    """Return where the whole cycles of a walk begin and end, s."""
    planned = gait_of(gait)
    return planned.cycle(1)[0], planned.cycle(gait.cycles)[1]


def _record(run: Run, start: float, end: float) -> Record:
    series = run.series
    assert series is not None
    inside = (series.time > start - 1e-4) & (series.time < end - 1e-4)
    return Record(series.time[inside] - start, series.pitch_rate[inside], series.slip[inside])


def bands_of(walks: Sequence[Walks]) -> tuple[Band, ...]:
    """Compare each walk with the first one that differs only by a lower gain of one loop.

    The one with less gain has ankle feedback. Walks are taken in the order of the experiment, so
    the unchanged scenario is preferred.
    """
    found = []
    for more, gain in product(walks, ('ankle_gain', 'hip_gain')):
        below = [
            less
            for less in walks
            if less.treatment.ankle_gain > 0.0
            and getattr(less.treatment, gain) < getattr(more.treatment, gain)
            and less.treatment == replace(more.treatment, **{gain: getattr(less.treatment, gain)})
        ]
        found += [Band(less, more, resonance(less, more)) for less in below[:1]]
    return tuple(found)


def settle(peak: PublishedPeak, walks: Sequence[Walks], bands: Sequence[Band]) -> Settled:
    """Find the origin of a published peak."""
    alike = [
        each
        for each in walks
        if each.treatment.cycle_period == GAIT_PERIOD
        and (each.treatment.ankle_gain, each.treatment.hip_gain)
        == (peak.ankle_gain, peak.hip_gain)
    ]
    own = max(alike, key=lambda each: each.treatment.inclination, default=None)
    loop = 'hip' if peak.hip_gain else 'ankle'
    near = tuple(
        band
        for band in bands
        if band.loop == loop
        and NEAR[0]
        <= (getattr(band.more.treatment, f'{loop}_gain') / getattr(peak, f'{loop}_gain'))
        <= NEAR[1]
    )
    if own is None:
        return Settled(peak, None, None, np.nan, near, 'no walk with these gains', 'low')
    line = strongest_near(
        own, [each for each in walks if each is not own], peak.frequency, LINE_HZ
    )
    share = line.amplitude / float(own.amplitude[1:].max())
    settled = Settled(peak, own, line, share, near, '', 'low')
    ringing = settled.holding
    stands = line.stands and share >= PEAK
    if stands and line.origin == 'gait':
        if not ringing:
            return replace(settled, verdict=f'{line.label}: the gait', sure=line.sure)
        return replace(settled, verdict=f'{line.label}: the gait, where the loop rings too')
    if stands and line.origin is not None:
        return replace(settled, verdict=line.label, sure=line.sure)
    if stands:
        return replace(
            settled,
            verdict='not settled: the experiments do not explain the peak there'
            + (', and the loop rings' if ringing else ''),
        )
    if ringing:
        most = len(ringing) > 1 and 2 * len(ringing) > len(near)
        return replace(
            settled,
            verdict='control: no line stands out there, and the loop rings',
            sure='medium' if most else 'low',
        )
    return replace(settled, verdict='not settled: nothing stands out there')


def study(runs: Runs) -> PeakStudy:
    """Find the origin of the peaks of a walk and of the published ones.

    Args:
        runs: of the experiment ``lines``, or of its cases on another scenario.

    Raises:
        StudyError: if no walk stayed up.
    """
    walks = walks_of(runs)
    bands = bands_of(walks)
    return PeakStudy(
        runs[0].scenario.name,
        walks,
        explained(walks),
        bands,
        tuple(settle(peak, walks, bands) for peak in PUBLISHED),
        lost_of(runs),
        null_rates(walks, PEAK),
    )


def run_variants(
    scenario: str,
    fast: bool,
    workers: int | None = None,
    root: Path = ROOT,
    changed: Sequence[str] = (),
) -> Runs:
    """Run the cases of the experiment ``lines`` on another scenario; return all finished runs.

    Args:
        scenario: file or name.
        fast: one seed.
        workers: processes; as many as there are cores by default.
        root: folder of the runs; runs of the same code are not repeated.
        changed: parameters to change in all variants, each ``node.parameter=value``.

    Raises:
        StudyError: if the scenario is no walk, or is not accepted.
        RunError: if the computation could not go on; what is finished is kept.
    """
    processes = check_workers(workers)
    walk = load_scenario(scenario)
    if walk.table(GaitParameters).motion != 'walk':
        raise StudyError(f'{scenario}: its motion is not accepted; accepted: a walk')
    text = shipped()[EXPERIMENT].read_text(encoding='utf-8')
    given = read_yaml(text, EXPERIMENT) | {'scenario': scenario}
    changes = {'.'.join(key): value for key, value in changes_of(changed).items()}
    given['set'] |= changes
    specification = sweep_from(given, f'{EXPERIMENT} of {scenario}', fast=fast)
    other = f'-{identity(changes, "")[:8]}' if changes else ''
    path = root / (walk.name + other + ('-fast' if fast else ''))
    run_sweeps({path: specification}, processes, EXPERIMENT)
    return runs_of(path)


def published_places() -> Places:
    """Return where the published peaks lie among the lines of the thesis's cycle."""
    return places([peak.frequency for peak in PUBLISHED], GAIT_PERIOD, LINE_HZ)


def explained(walks: Sequence[Walks]) -> tuple[Line, ...]:
    """Find the origin of the first walks' peaks by comparison with all others."""
    return origins(walks[0], walks[1:], PEAK)
