"""``khr lines``: the origin of a walk's spectral peaks, and what raises line 11, 4.74 Hz.

The halves of the gait's cycle are mirror images, and a mirrored motion has the same pitch. So a
symmetric robot has lines of even number only; an odd line needs a robot or a walk with unlike
halves.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, radians
from pathlib import Path
from typing import NamedTuple

import numpy as np

from khr_analysis.peaks import Peak, place_in_gait
from khr_analysis.recorded_spectrum import recorded_spectrum
from khr_analysis.sampling import samples_at, within
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.channel import read_channel
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import Scenario, changes_of, load_scenario
from khr_common.errors import KhrError
from khr_common.strict_yaml import read_yaml
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import Condition
from khr_studies.measuring.experiments import (
    Run,
    Runs,
    experiment_files,
    group_by,
    run_sweeps,
    runs_of,
)
from khr_studies.peak_origin.cycle_spectrum import Record, Treatment, Walks
from khr_studies.peak_origin.origin import PEAK, FalseLabels, Line, count_false_labels, label_peaks
from khr_studies.peak_origin.thesis_peaks import (
    THESIS_PEAKS,
    Band,
    JudgedPeak,
    compare_gains,
    judge_peak,
)
from khr_sweeps.axes import CASE
from khr_sweeps.pool import check_workers
from khr_sweeps.reading import sweep_from
from khr_sweeps.trial import Row, identity

EXPERIMENT, LINE_11 = 'lines', 'line_11'
ROOT = Path('runs/lines')
NUMBER = 11  # of the line: 4.76 Hz
LISTED = 4  # largest lines of a spectrum that the thesis lists


@dataclass(frozen=True)
class PeakStudy:
    """The spectral peaks of a walk and their origins."""

    scenario: str  # name of the walk
    walks: tuple[Walks, ...]  # the walk, then its variants
    lines: tuple[Line, ...]  # peaks of the first walks
    bands: tuple[Band, ...]  # comparisons of gains, between the lines
    judged: tuple[JudgedPeak, ...]  # peaks of the thesis
    lost: str  # dropped runs, in which the robot did not stay up, as text
    false_labels: FalseLabels  # error rate of the experiments

    @property
    def origins(self) -> list[Row]:
        """Return the origins of the thesis's peaks."""
        return [each.origin for each in self.judged]


class ExplainedWalks(NamedTuple):
    """The peaks of some walks, explained by comparison with all others."""

    walks: Walks
    band: Band | None  # comparison with walks with less gain; None if there are no such walks
    lines: tuple[Line, ...]  # the peaks


def walks_of(runs: Runs) -> tuple[Walks, ...]:
    """Return the records of the runs that stayed up, by case.

    Raises:
        KhrError: if no run stayed up, or no run has its signals.
    """
    kept = group_by((run for run in runs if run.stayed_up and run.series), _case)
    if not kept:
        raise KhrError('lines: no walk stayed up; accepted: a scenario that the robot walks')
    return tuple(_walks(label, some) for label, some in kept.items())


def lost_runs(runs: Runs) -> str:
    """Return the cases with runs that did not stay up, and their numbers, as text."""
    lost = [
        f'{label} ({count} of {len(some)})'
        for label, some in group_by(runs, _case).items()
        if (count := sum(run.row['stayed_up'] is False for run in some))
    ]
    return ', '.join(lost) or 'none'


def _case(run: Run) -> str:
    return str(run.point.get(CASE, ''))


def _walks(label: str, runs: Runs) -> Walks:
    scenario = runs[0].scenario
    start, end = whole_cycles(scenario.table(GaitParameters))
    records = []
    for run in runs:
        series = run.series
        assert series is not None
        part = series.during((series.time > start - 1e-4) & (series.time < end - 1e-4))
        records.append(Record(part.time - start, part.pitch_rate, part.slip))
    period = scenario.table(RunParameters).control_period
    return Walks(label, _treatment(scenario), tuple(records), period)


def _treatment(scenario: Scenario) -> Treatment:
    simulator, (condition, _) = scenario.table(RunParameters), Condition.of(scenario)
    return Treatment(
        scenario.table(GaitParameters).cycle_period,
        condition.ankle_gain,
        condition.hip_gain,
        simulator.sole_friction,
        radians(simulator.inclination_deg),
    )


def whole_cycles(gait: GaitParameters) -> tuple[float, float]:
    """Return start and end of the whole cycles of a walk, s."""
    planned = gait_of(gait)
    return planned.cycle(1)[0], planned.cycle(gait.cycles)[1]


def study(runs: Runs) -> PeakStudy:
    """Find the origin of the peaks of a walk and of the thesis's peaks.

    Args:
        runs: of the experiment ``lines``, or of its cases on another scenario.

    Raises:
        KhrError: if no walk stayed up.
    """
    walks = walks_of(runs)
    bands = compare_gains(walks)
    tried = [_treatment(some[0].scenario) for some in group_by(runs, _case).values()]
    return PeakStudy(
        runs[0].scenario.name,
        walks,
        label_peaks(walks[0], walks[1:], PEAK),
        bands,
        tuple(judge_peak(peak, walks, bands, tried) for peak in THESIS_PEAKS),
        lost_runs(runs),
        count_false_labels(walks, PEAK),
    )


def explain_all(runs: Mapping[str, Runs]) -> list[ExplainedWalks]:
    """Find the origin of the peaks of every walk of the experiment ``lines``.

    Raises:
        KhrError: if no walk stayed up.
    """
    walks = walks_of(runs[EXPERIMENT])
    bands = {band.more.label: band for band in compare_gains(walks)}
    return [
        ExplainedWalks(
            each,
            bands.get(each.label),
            label_peaks(each, [other for other in walks if other is not each], PEAK),
        )
        for each in walks
    ]


def run_variants(
    scenario: str, fast: bool, workers: int | None = None, changed: Sequence[str] = ()
) -> Runs:
    """Run the cases of the experiment ``lines`` on another scenario; return all finished runs.

    Args:
        scenario: file or name.
        fast: whether to run one seed only.
        changed: parameters to change in all variants, each ``node.parameter=value``.

    Raises:
        KhrError: if the scenario is no walk, or is not accepted.
        RunError: if the computation was aborted; finished runs are kept.
    """
    processes = check_workers(workers)
    walk = load_scenario(scenario)
    if walk.table(GaitParameters).motion != 'walk':
        raise KhrError(f'{scenario}: its motion is not accepted; accepted: a walk')
    text = experiment_files()[EXPERIMENT].read_text(encoding='utf-8')
    given = read_yaml(text, EXPERIMENT) | {'scenario': scenario}
    changes = {'.'.join(key): value for key, value in changes_of(changed).items()}
    given['set'] |= changes
    specification = sweep_from(given, f'{EXPERIMENT} of {scenario}', fast=fast)
    other = f'-{identity(changes, "")[:8]}' if changes else ''
    path = ROOT / (walk.name + other + ('-fast' if fast else ''))
    run_sweeps({path: specification}, processes, EXPERIMENT)
    return runs_of(path)


def measure_line_11(runs: Mapping[str, Runs]) -> list[Row]:
    """Measure line 11 in each case of the experiment, in its order.

    Args:
        runs: by experiment, at least those of ``line_11``.

    Returns:
        A row per case with its name ``case``, the number of ``runs``, the ``frequency`` of the
        line, Hz, and for the walks that stayed up the ``amplitudes`` of the line, rad/s, their
        ``shares`` of the largest line, the number of walks in which it is ``among`` the four
        largest lines, and the root-sum-square ratio of ``odd`` over even lines.

    Raises:
        KhrError: if no walk stayed up.
    """
    done = runs[LINE_11]
    if not done:
        raise KhrError(f'{LINE_11}: 0 runs are not accepted; accepted: finished runs')
    counts = Counter(run.point[CASE] for run in done)
    return [
        {'case': walks.label, 'runs': counts[walks.label], **_lines(walks)}
        for walks in walks_of(done)
    ]


def _lines(walks: Walks) -> Row:
    lines = walks.amplitudes[:, walks.cycles :: walks.cycles]  # of numbers 1, 2, ...
    own = lines[:, NUMBER - 1]
    odd, even = np.sum(lines[:, 0::2] ** 2), np.sum(lines[:, 1::2] ** 2)
    return {
        'frequency': NUMBER / walks.treatment.cycle_period,
        'amplitudes': own.tolist(),
        'shares': (own / lines.max(axis=1)).tolist(),
        'among': int(np.sum(np.sum(lines > own[:, None], axis=1) < LISTED)),
        'odd': float(np.sqrt(odd / even)),
    }


@dataclass(frozen=True)
class RecordedPeaks:
    """The peaks of one signal in a recording."""

    run: str  # title or name of the recording
    signal: str  # the signal and its source
    unit: str  # of the amplitudes
    # begin, end: of the analysed part, s
    begin: float
    end: float
    cycle: float  # of the gait, s; 0 if the robot did not walk
    peaks: tuple[Peak, ...]  # the largest first, amplitudes in unit
    notes: tuple[str, ...] = ()  # on rate, corrections and resolution, a sentence each

    def place(self, peak: Peak) -> str:
        """Return the place of a peak among the lines of the gait; empty without a gait."""
        return place_in_gait(peak.frequency, self.cycle)


def peaks_of_recording(
    path: Path, topic: str = '', axis: str = '', namespace: str = ''
) -> RecordedPeaks:
    """Return the peaks of a recording: of a khr run, or of any topic of any other.

    Args:
        path: the recording, one of its files, or the folder of a run.
        topic: to analyse; by default the pitch rate of a khr run, else the only Imu.
        axis: of the topic.
        namespace: of the robot, in a recording of several.
    """
    if not (topic or axis):
        run = RecordedRun(path, namespace=namespace, salvage=True)
        if run.has_scenario:
            own = peaks_of(str(path), run.parameters, run.series)
            damage = (f'A part of the recording: {run.damage}.',) if run.damage else ()
            return replace(own, notes=(*damage, *own.notes))
    channel = read_channel(path, topic, axis, namespace)
    found, unit = recorded_spectrum(channel.even()), channel.quantity.unit
    lines = found.spectrum
    span = lines.start, lines.end
    return RecordedPeaks(str(path), channel.label, unit, *span, 0.0, lines.peaks, found.notes)


def peaks_of(name: str, scenario: Scenario, series: Series) -> RecordedPeaks:
    """Return the peaks of the pitch rate of a khr run, over the whole cycles of a walk.

    One run shows the places of its peaks only. The origin of peaks between the lines needs runs
    with other gains, cycles or friction (:func:`khr_studies.peak_origin.study.run_variants`).

    Raises:
        KhrError: if there is no pitch rate, or one of fewer than eight samples.
    """
    gait, parameters = scenario.table(GaitParameters), scenario.table(FftAnalyserParameters)
    walks = gait.cyclic
    simulated = np.isfinite(series.pitch_rate).any()
    rate = series.pitch_rate if simulated else series.gyro_rate
    if not np.isfinite(rate).any():
        raise KhrError(f'{name}: no pitch rate in it; accepted: a run with a gyro')
    samples = samples_at(series.time, np.degrees(rate))
    title = scenario.title or name
    signal = f'pitch rate, by the {"true rate of the torso" if simulated else "gyro"}'
    begin, end = _cycles(gait, *samples.span) if walks else (0.0, 0.0)
    if end - begin < gait.cycle_period - samples.period:  # no whole cycle
        whole = recorded_spectrum(samples)
        unplaced = ('No whole cycle of the gait: the lines have no place in it.',) if walks else ()
        notes = (*unplaced, *whole.notes)
        lines, cycle = whole.spectrum, 0.0
    else:
        part = within(samples, begin, end)
        own = replace(parameters, control_period=part.period, window_length=gait.cycle_period)
        lines = spectrum(part.values, own, part.start)
        notes, cycle = part.notes, gait.cycle_period
    return RecordedPeaks(title, signal, 'deg/s', lines.start, lines.end, cycle, lines.peaks, notes)


def _cycles(gait: GaitParameters, begin: float, end: float) -> tuple[float, float]:
    """Return begin and end, s, of the whole cycles of a walk within a part of it."""
    first, last = whole_cycles(gait)
    period, little = gait.cycle_period, 1e-6
    before = max(0, ceil((begin - first) / period - little))
    after = floor((min(last, end) - first) / period + little)
    return first + before * period, first + max(before, after) * period
