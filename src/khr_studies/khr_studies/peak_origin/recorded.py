"""``khr lines FOLDER``: the peaks of one recorded run, by their place among the gait's lines."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor
from pathlib import Path

import numpy as np

from khr_analysis.peaks import Peak, place_in_gait
from khr_analysis.spectrum import FftAnalyserParameters, spectrum
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_sim.run_parameters import RunParameters
from khr_studies.peak_origin.study import whole_cycles

SYSTEM_TIME = 1e6  # s, longer than any run: a larger timestamp is system time


@dataclass(frozen=True)
class RecordedPeaks:
    """The peaks of the pitch rate in one run.

    Attributes:
        run: title or name of the run.
        signal: source of the rate.
        begin, end: of the analysed part, s.
        cycle: of the gait, s; 0 if the robot did not walk.
        peaks: the largest first.
    """

    run: str
    signal: str
    begin: float
    end: float
    cycle: float
    peaks: tuple[Peak, ...]

    def place(self, peak: Peak) -> str:
        """Return the place of a peak among the lines of the gait; empty without a gait."""
        return place_in_gait(peak.frequency, self.cycle)


def peaks_of_run(folder: Path) -> RecordedPeaks:
    """Return the peaks of a recorded run, of the simulator or a driver.

    Args:
        folder: of the run, or its bag.

    Raises:
        KhrError: if there is no bag, or the bag is damaged.
        KhrError: see :func:`peaks_of`.
    """
    run = RecordedRun(folder)
    return peaks_of(str(folder), run.parameters, run.series)


def peaks_of(name: str, scenario: Scenario, series: Series) -> RecordedPeaks:
    """Return the peaks of the pitch rate, over the whole cycles of a walk.

    One run shows the places of its peaks only. The origin of peaks between the lines needs runs
    with other gains, cycles or friction (:func:`khr_studies.peak_origin.study.run_variants`).

    Args:
        name: of the run, for messages.
        scenario: parameters of the run.
        series: signals of the run.

    Raises:
        KhrError: if the pitch rate is shorter than the window of a spectrum.
    """
    gait, period = scenario.table(GaitParameters), scenario.table(RunParameters).control_period
    walks = gait.motion == 'walk'
    simulated = np.isfinite(series.pitch_rate).any()
    rate = series.pitch_rate if simulated else series.gyro_rate
    known = np.isfinite(rate)
    if not known.any():
        raise KhrError(f'{name}: no pitch rate in it; accepted: a run with a gyro')
    # A driver may use system time and drop samples.
    own = series.time[known] - (series.time[known][0] if series.time[0] > SYSTEM_TIME else 0.0)
    times = np.arange(own[0], own[-1] + period / 2.0, period)
    begin, end = own[0], own[-1] + period
    if walks:
        begin, last = whole_cycles(gait)
        cycles = floor((min(last, end) - begin) / gait.cycle_period + 1e-6)
        end = begin + cycles * gait.cycle_period
    inside = (times > begin - period / 2.0) & (times < end - period / 2.0)
    parameters = FftAnalyserParameters(control_period=period)
    if inside.sum() < parameters.size:
        raise KhrError(
            f'{name}: {"no whole cycle of the gait" if walks else f"{own[-1] - own[0]:.2f} s"} '
            f'is not enough; accepted: {"one" if walks else f"{parameters.window_length:g} s"} or more'
        )
    rates = np.interp(times[inside], own, rate[known])
    found = spectrum(rates, parameters, float(times[inside][0]))
    return RecordedPeaks(
        scenario.title or name,
        'true rate of the torso' if simulated else 'gyro',
        found.start,
        found.end,
        gait.cycle_period if walks else 0.0,
        found.peaks,
    )
