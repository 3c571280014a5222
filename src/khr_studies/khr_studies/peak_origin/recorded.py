"""``khr lines FOLDER``: the peaks of one recording, of a walk by their place in its gait."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor
from pathlib import Path

import numpy as np

from khr_analysis.peaks import Peak, place_in_gait
from khr_analysis.recorded_spectrum import recorded_spectrum
from khr_analysis.sampling import samples_at, within
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.channel import read_channel
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_studies.peak_origin.study import whole_cycles


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
        run = RecordedRun(path, namespace=namespace)
        if run.has_scenario:
            return peaks_of(str(path), run.parameters, run.series)
    channel = read_channel(path, topic, axis, namespace)
    found = recorded_spectrum(channel.even())
    return RecordedPeaks(
        str(path),
        channel.label,
        channel.quantity.unit,
        found.spectrum.start,
        found.spectrum.end,
        0.0,
        found.spectrum.peaks,
        found.notes,
    )


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
