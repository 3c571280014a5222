"""The amplitude and phase spectrum of the pitch rate over a sliding window."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, isfinite
from typing import NamedTuple

import numpy as np

from khr_analysis.peaks import DOMINANT_SHARE, WINDOWS, Array, Peak, find_tones
from khr_analysis.quantities import QUANTITIES
from khr_common import KhrError, ParameterError, fixed, parameter, sample_period
from khr_common.block import NodeSpec
from khr_common.interfaces import GYRO, PEAKS, READY, SPECTRUM, STATE
from khr_common.published import GAIT_FREQUENCY, GAIT_PERIOD

# Timestamps jitter and driver clocks drift: FOLLOWED is the share of the delay of a sample that
# shifts the due time. The share is larger at first, while the due time is the mean of few samples;
# until then a sample may be off by OFF_AT_FIRST.
FOLLOWED, SETTLED = 0.05, 20
WRONG_RATE = 0.01  # deviation of the rate of the samples, from which on it is taken instead
RATE_SAMPLES = 50  # whose intervals show the rate after a reset
OFF, OFF_AT_FIRST = 0.5, 0.75  # of a period


@dataclass(frozen=True)
class FftAnalyserParameters:
    """The parameter table of the spectrum analyser.

    Raises:
        ParameterError: if the window holds fewer than eight samples, or the spectrum no bin
            besides the mean.
    """

    window_length: float = parameter(
        GAIT_PERIOD,
        'Length of the window, rounded to whole control periods; khr makes it one gait cycle '
        'unless the scenario states it.',
        '[0.1, 60] s',
    )
    window: str = parameter(
        'rectangular',
        'Window function. Over whole gait cycles "rectangular" puts every line of '
        'the gait on a bin of its own; for other lengths take "hann".',
        choices=('rectangular', 'hann'),
    )
    input_type: str = fixed(
        'sensor_msgs/msg/Imu',
        'Type of the topic to analyse, imu/data_raw or the one it is remapped to.',
        choices=tuple(QUANTITIES),
    )
    axis: str = fixed(
        '', 'Axis to analyse: x, y or z; of a JointState a joint. By default y, of a force z.'
    )
    remove_mean: bool = parameter(True, 'Subtract the mean of the window first.')
    rate: float = parameter(
        5.0,
        'Spectra per second, once the window is full; rounded to whole control periods.',
        '[0.01, 100] Hz',
    )
    max_frequency: float = parameter(15.0, 'Highest frequency given.', '[0.5, 500] Hz')
    phase_threshold: float = parameter(
        DOMINANT_SHARE, 'Amplitude from which on a phase is given, over the largest.', '[0, 1]'
    )
    peak_count: int = parameter(8, 'Largest number of peaks.', '[1, 50]')
    peak_threshold: float = parameter(
        0.1, 'Smallest peak given, over the largest amplitude.', '[0, 1]'
    )
    fundamental: float = parameter(
        GAIT_FREQUENCY, 'f_0, four peaks per gait cycle; names the peaks.', '[0.1, 20] Hz'
    )
    control_period: float = sample_period()

    def __post_init__(self) -> None:
        if self.size < 8:
            raise ParameterError.refused(
                'window_length',
                self.window_length,
                f'at least {8 * self.control_period:g} s, eight control periods',
            )
        if self.max_frequency * self.window_length < 1.0 - 1e-9:
            raise ParameterError.refused(
                'max_frequency',
                self.max_frequency,
                f'at least {1.0 / self.window_length:.4g} Hz, 1 / window_length',
            )

    @property
    def size(self) -> int:
        """Count the samples in a window."""
        return round(self.window_length / self.control_period)


FFT_ANALYSER = NodeSpec(
    'fft_analyser',
    'khr_analysis',
    FftAnalyserParameters,
    subscribes=(GYRO, STATE),
    publishes=(SPECTRUM, PEAKS, READY),
    node='khr_analysis.nodes.fft_analyser:FftAnalyserNode',
    listens=True,
)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """One window's spectrum.

    Attributes:
        start: time of the window's first sample, s.
        end: time of its last sample, s.
        frequency: of the bins, Hz, (n,).
        amplitude: of the bins, in the unit of the signal, (n,): a sine of amplitude A on a bin
            reads A. The first bin is the mean.
        phase: of the bins, rad, (n,): the phase of a cosine that starts with the window; NaN where
            the amplitude is below the threshold.
        peaks: the largest first. A pure tone reads true on a bin; between bins, from the fourth
            bin on, within 8 % in amplitude and 0.04 bins in frequency with the rectangular
            window, within 0.2 % and 0.001 bins with the Hann window (found by sweeping tones over
            frequency and phase). The error comes from the tone's mirror image below 0 Hz; without
            a window its lobe falls off slowly.
    """

    start: float
    end: float
    frequency: Array
    amplitude: Array
    phase: Array
    peaks: tuple[Peak, ...]

    @property
    def amplitude_deg(self) -> Array:
        """Return the amplitudes of a signal in rad/s in deg/s, (n,)."""
        return np.asarray(np.degrees(self.amplitude))

    def __repr__(self) -> str:
        """Show the window and the peaks, of a signal in rad/s; the bins are many."""
        peaks = ', '.join(
            f'{each.frequency:.2f} Hz {each.amplitude_deg:.2f} deg/s ({each.label})'
            for each in self.peaks
        )
        return f'Spectrum({self.start:.3f} s to {self.end:.3f} s, peaks {peaks or "none"})'


def spectrum(
    samples: Sequence[float] | Array, parameters: FftAnalyserParameters, start: float = 0.0
) -> Spectrum:
    """Return the spectrum of one window of any length.

    Args:
        samples: (N,), one per control period.
        parameters: all but ``window_length`` and ``rate``.
        start: time of the first sample, s.

    Raises:
        KhrError: if there are fewer than eight samples or one is not finite.
    """
    signal = np.asarray(samples, dtype=np.float64)
    if signal.ndim != 1 or signal.size < 8 or not np.isfinite(signal).all():
        raise KhrError(
            f'samples: shape {signal.shape} is not accepted; accepted: (N,) finite numbers, N >= 8'
        )
    if parameters.remove_mean:
        signal = signal - signal.mean()
    window, size = WINDOWS[parameters.window], signal.size
    weights = window.weights(size)
    transform = 2.0 * np.fft.rfft(weights * signal)
    transform[0] /= 2.0  # 0 Hz and the Nyquist frequency have no mirror image
    if size % 2 == 0:
        transform[-1] /= 2.0
    spacing = 1.0 / (size * parameters.control_period)
    kept = min(transform.size, int(parameters.max_frequency / spacing + 1e-9) + 1)
    amplitude: Array = np.abs(transform[:kept])
    largest = float(amplitude.max())
    phase: Array = np.angle(transform[:kept])
    phase[(amplitude < parameters.phase_threshold * largest) | (amplitude == 0.0)] = np.nan
    peaks = find_tones(
        transform[: kept + 1],
        window,
        spacing,
        float(weights @ np.arange(size)) / size,
        parameters.peak_count,
        parameters.peak_threshold * largest,
        parameters.fundamental,
    )
    return Spectrum(
        start,
        start + (size - 1) * parameters.control_period,
        spacing * np.arange(kept, dtype=np.float64),
        amplitude,
        phase,
        peaks,
    )


class _Sample(NamedTuple):
    time: float  # s
    value: float
    bridged: bool  # whether it was missing and is the mean of its neighbours


class SpectrumAnalyser:
    """Give the spectrum of the last window, several times a second.

    Attributes:
        reason: of the last reset of the window; empty before the first reset.
    """

    def __init__(self, parameters: FftAnalyserParameters) -> None:
        self.parameters = self._own = parameters
        self._samples: deque[_Sample] = deque(maxlen=parameters.size)
        self._steps: deque[float] = deque(maxlen=RATE_SAMPLES)
        self._last: float | None = None
        self._due = 0.0  # when the next sample is due, s
        self._wait = 0
        self.reason = ''

    def configure(self, parameters: FftAnalyserParameters) -> None:
        """Take changed parameters from the next sample on, keeping the samples that fit."""
        self._own = parameters
        self._take(self.parameters.control_period)

    def add(self, time: float, value: float) -> Spectrum | None:
        """Take a sample; return a spectrum if the window is full and the next one is due.

        A repeated time is ignored. A sample counts for its control period if it comes up to half a
        period before or after it is due; the due time follows slowly, as the clock of a driver
        drifts. A single sample that is missing is bridged by the mean of its neighbours. A longer
        gap, or a time that goes back, empties the window and sets ``reason``: a spectrum
        over a gap would belong to a different signal. If the samples come at another rate than that
        of ``control_period``, their own rate is taken, and ``reason`` states it.

        Args:
            time: s; about one control period after the last.
            value: in any unit.
        """
        if not isfinite(value):
            raise KhrError.refused('value', value, 'finite')
        if time == self._last:
            return None
        if self._last is not None:
            self._steps.append(time - self._last)
        if self._place(time) == 1:
            last = self._samples[-1]
            middle = (last.time + time) / 2.0, (last.value + float(value)) / 2.0
            self._samples.append(_Sample(*middle, bridged=True))
            self._wait -= 1
        self._last = time
        self._samples.append(_Sample(time, float(value), bridged=False))
        self._wait -= 1
        if len(self._samples) < self.parameters.size or self._wait > 0:
            return None
        if self._correct(self._rate_of_window()):
            return None
        self._wait = max(1, round(1.0 / (self.parameters.rate * self.parameters.control_period)))
        start = time - (len(self._samples) - 1) * self.parameters.control_period
        return spectrum([each.value for each in self._samples], self.parameters, start)

    def _rate_of_steps(self) -> float:
        """Return the interval between the last samples, s, without gaps; 0 if it is not known."""
        if len(self._steps) < SETTLED:
            return 0.0
        usual = sorted(self._steps)[len(self._steps) // 2]
        whole = [step for step in self._steps if 0.0 < step < 1.6 * usual]
        return sum(whole) / max(1, len(whole))

    def _rate_of_window(self) -> float:
        """Return the interval between the samples of a full window, s.

        Samples that are lost leave intervals of two periods. Where some were bridged and hardly an
        interval is that long, none was lost: the samples come at a lower rate.
        """
        came = np.array([each.time for each in self._samples if not each.bridged])
        steps = np.diff(came)
        single = steps[steps < 1.5 * np.median(steps)]
        lost = len(steps) - len(single)
        if len(self._samples) - len(came) > 1 + 2 * lost:
            return float(np.mean(single))
        return (self._samples[-1].time - self._samples[0].time) / (len(self._samples) - 1)

    def _correct(self, period: float) -> bool:
        """Take the interval of the samples, s, if it is another than the present one."""
        given = self.parameters.control_period
        if not period or abs(period / given - 1.0) < WRONG_RATE:
            return False
        self.reason = (
            f'samples come every {period:.4g} s ({1.0 / period:.4g} Hz), not every {given:.4g} s: '
            'their own rate is taken'
        )
        self._samples.clear()
        self._take(period)
        return True

    def _take(self, period: float) -> None:
        """Use the parameters with this period between samples, and a window of eight or more."""
        own = self._own
        if period != own.control_period:
            length = max(own.window_length, 8.0 * period)
            own = replace(own, control_period=period, window_length=length)
        self.parameters = own
        self._samples = deque(self._samples, maxlen=own.size)

    def _place(self, time: float) -> int:
        """Return how many samples are missing before this one, of those that can be bridged."""
        period, late = self.parameters.control_period, 0.0
        missing = 0
        if self._last is not None:
            late = time - self._due
            off = OFF_AT_FIRST if len(self._samples) < SETTLED else OFF
            missing = ceil(late / period - off) if late > 0.0 else floor(late / period + off)
            late -= missing * period
            if missing not in (0, 1):
                self.reason = (
                    f'{time - self._last:.4f} s between the samples at {self._last:.4f} s and '
                    f'{time:.4f} s, not the control period of {period:.4f} s'
                )
                self._samples.clear()
                missing, late = 0, 0.0
                self._correct(self._rate_of_steps())
                period = self.parameters.control_period
        followed = max(FOLLOWED, 1.0 / (len(self._samples) + 1))
        self._due = time + period - (1.0 - followed) * late
        return missing
