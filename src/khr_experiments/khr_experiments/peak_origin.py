"""``khr lines``: which peaks of a walk's spectrum the gait makes, the feedback, and slipping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby, product
from math import radians
from pathlib import Path

import numpy as np
import yaml

from khr_analysis.cycle_spectrum import Record, Treatment, Walks
from khr_analysis.line_chance import Places, places
from khr_analysis.models.thesis import GAIT_PERIOD
from khr_analysis.origin import Line, Sureness, origins, strongest_near
from khr_analysis.resonance import Resonance, resonance
from khr_balance.ankle import AnkleControllerParameters
from khr_balance.gait import Gait
from khr_balance.gait_parameters import GaitParameters
from khr_balance.hip import HipControllerParameters
from khr_bringup.scenario import load
from khr_bringup.strict_yaml import read_yaml
from khr_experiments.errors import ExperimentError
from khr_experiments.experiments import Run, Runs, run, runs_of, shipped
from khr_experiments.published import LINE_HZ
from khr_experiments.sweeps import tell_lost
from khr_experiments.sweeps.axes import CASE
from khr_experiments.sweeps.reading import parse
from khr_sim.run_parameters import RunParameters

EXPERIMENT = 'lines'
ROOT = Path('runs/lines')
PEAK = 0.1  # of the largest amplitude; what is lower is not called a peak
NEAR = (0.9, 2.0)  # gains from and to these times a published one speak of its loop


@dataclass(frozen=True)
class PublishedPeak:
    """A peak that Dutta (2021) calls a control frequency, and the gains that it came with."""

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
)  # which K_H made 7.33 Hz is our reading


@dataclass(frozen=True)
class Band:
    """What one walk has between the lines that a walk with less gain on the same ground lacks."""

    less: Walks
    more: Walks
    found: Resonance | None

    @property
    def loop(self) -> str:
        """Name the gain that was raised."""
        return 'hip' if self.more.treatment.hip_gain > self.less.treatment.hip_gain else 'ankle'


@dataclass(frozen=True)
class Settled:
    """What the runs say of a published peak.

    Attributes:
        walks: with its gains, on the steepest ground that they survived; None without such.
        line: the strongest bin within the reading error there.
        share: its amplitude over the largest one.
        bands: comparisons of the loop that was on, at gains like the published one or above it.
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
    def holding(self) -> tuple[Band, ...]:
        """Return the bands that hold the published frequency."""
        return tuple(
            band for band in self.bands if band.found and band.found.holds(self.peak.frequency)
        )


def walks_of(runs: Runs) -> tuple[Walks, ...]:
    """Return what the surviving runs of each case recorded over the whole cycles of the gait.

    Raises:
        ExperimentError: if no run survived with its signals kept.
    """
    found = []
    for label, group in groupby(runs, key=lambda run: str(run.point.get(CASE, ''))):
        kept = [run for run in group if run.row['verdict'] not in (None, 'fell') and run.series]
        if kept:
            found.append(_walks(label, kept))
    if not found:
        raise ExperimentError('lines: no walk survived; accepted: a scenario that the robot walks')
    return tuple(found)


def fallen_of(runs: Runs) -> str:
    """Tell how many runs of each case fell and are not looked at."""
    counts = {
        label: [run.row['verdict'] == 'fell' for run in group]
        for label, group in groupby(runs, key=lambda run: str(run.point.get(CASE, '')))
    }
    return (
        ', '.join(
            f'{label} ({sum(fell)} of {len(fell)})' for label, fell in counts.items() if any(fell)
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
    start, end = _whole_cycles(gait)
    return Walks(
        label, treatment, tuple(_record(run, start, end) for run in runs), simulator.control_period
    )


@cache
def _whole_cycles(gait: GaitParameters) -> tuple[float, float]:
    """Return where the whole cycles of a walk begin and end, s."""
    planned = Gait(gait)  # takes a fifth of a second
    return planned.cycle(1)[0], planned.cycle(gait.cycles)[1]


def _record(run: Run, start: float, end: float) -> Record:
    series = run.series
    assert series is not None
    inside = (series.time > start - 1e-4) & (series.time < end - 1e-4)
    return Record(series.time[inside] - start, series.pitch_rate[inside], series.slip[inside])


def bands_of(walks: Sequence[Walks]) -> tuple[Band, ...]:
    """Compare each walk with the first that has feedback and less gain of one loop.

    All else is equal. The order of the experiment is thus the order of what is compared with: the
    scenario as it is comes first.
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
    """Say what the runs make of a published peak."""
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
    if share >= PEAK and line.origin == 'gait':
        if not ringing:
            return replace(settled, verdict=f'{line.label}: the gait', sure=line.sure)
        return replace(settled, verdict=f'{line.label}: the gait, where the loop rings too')
    if share >= PEAK and line.origin is not None:
        return replace(settled, verdict=line.label, sure=line.sure)
    if share >= PEAK:
        return replace(
            settled,
            verdict='not settled: the experiments on the peak there tie'
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


def run_variants(scenario: str, fast: bool, workers: int, root: Path = ROOT) -> Runs:
    """Run the cases of the experiment ``lines`` on another scenario; return all finished runs.

    Args:
        scenario: file or name.
        fast: one seed.
        workers: processes.
        root: where the runs are kept; what is there of the same code is not repeated.

    Raises:
        ExperimentError: if the scenario is no walk, or is not accepted.
        RunError: if the computation could not go on; what is finished is kept.
    """
    walk = load(scenario)
    if walk.table(GaitParameters).motion != 'walk':
        raise ExperimentError(f'{scenario}: its motion is not accepted; accepted: a walk')
    text = shipped()[EXPERIMENT].read_text(encoding='utf-8')
    given = read_yaml(text, EXPERIMENT) | {'scenario': scenario}
    specification = parse(
        yaml.safe_dump(given, sort_keys=False), f'{EXPERIMENT} of {scenario}', fast
    )
    path = root / (walk.name + ('-fast' if fast else ''))
    if lost := run({path: specification}, workers, EXPERIMENT):
        tell_lost(lost)
    return runs_of(path)


def published_places() -> Places:
    """Return where the published peaks lie among the lines of the thesis's cycle."""
    return places([peak.frequency for peak in PUBLISHED], GAIT_PERIOD, LINE_HZ)


def explained(walks: Sequence[Walks]) -> tuple[Line, ...]:
    """Label the peaks of the first walks by all others."""
    return origins(walks[0], walks[1:], PEAK)
