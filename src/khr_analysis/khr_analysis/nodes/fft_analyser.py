"""The FFT analyser node: the spectrum of the torso's pitch rate while the robot moves."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from khr_analysis.quantities import QUANTITIES, stamp_of
from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, SpectrumAnalyser
from khr_common.block import NodeSpec
from khr_common.errors import MalformedError
from khr_common.interfaces import GYRO, IMU, PEAKS, RATE_AMPLITUDE, SPECTRUM
from khr_common.nodes.listener import Listener
from khr_common.nodes.messages import restamp, status
from khr_common.stamps import RunTime, StampSequence

QUIET = 10.0  # s of wall time between warnings
# name and unit of the amplitudes of an Imu, and of another type, in the unit of its messages
RATE, OTHER = (RATE_AMPLITUDE, ' rad/s'), ('amplitude', '')


class FftAnalyserNode(Listener):
    """Turn ``imu/data_raw`` into ``spectrum`` and ``spectrum/peaks``.

    ``spectrum`` holds three rows (its first dimension): frequency in Hz, amplitude in rad/s, phase
    in rad (NaN where the amplitude is below the threshold). ``spectrum/peaks`` holds
    one status per peak, the strongest first, named by its label. The amplitudes of another
    ``input_type`` have the unit of its messages, and are labelled ``amplitude``.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._analyser = SpectrumAnalyser(self.parameters)
        self._stamps, self._time = StampSequence(), RunTime()
        self._spectrum = self.publisher(SPECTRUM)
        self._peaks = self.publisher(PEAKS)
        own = self.parameters
        self._last: tuple[int, float] | None = None
        self._unstamped = False
        if own.input_type == IMU and own.axis in ('', *'xyz'):
            place = 'xyz'.index(own.axis or 'y')
            self.subscribe_numbers(GYRO, lambda _, at, rates: self._on_sample(at, rates[place]))
        else:
            self._quantity = QUANTITIES[own.input_type]
            self.subscribe(replace(GYRO, kind=own.input_type), self._on_message)

    def configure(self, parameters: FftAnalyserParameters) -> None:
        """Pass changed parameters to the analyser."""
        self._analyser.configure(parameters)

    @property
    def answered_ns(self) -> int:
        """The time of the last sample."""
        return self._time.since_start(self.now_ns)

    def _on_message(self, message: Any) -> None:
        rows = dict(self._quantity.read(message))
        axis = self.parameters.axis or self._quantity.default or next(iter(rows), '')
        if axis not in rows:
            self.fail(f'axis: {axis!r} is not accepted; accepted: {", ".join(rows)}')
            return
        if not isfinite(rows[axis]):
            raise MalformedError('numbers that are not finite')
        stamp_ns = stamp_of(message)
        self._unstamped |= stamp_ns is None
        self._on_sample(stamp_ns or 0, rows[axis])

    def _time_of(self, stamp_ns: int, value: float) -> int:
        """Return the timestamp of a sample, or of its arrival if the samples have none, ns."""
        again = stamp_ns == 0 and self._last is not None and self._last[0] == 0
        if again and not self._unstamped and self._last != (0, value):
            self._unstamped = True
            self.get_logger().warning('timestamps are zero: times of arrival are used')
        self._last = stamp_ns, value
        return self.get_clock().now().nanoseconds if self._unstamped else stamp_ns

    def _on_sample(self, stamp_ns: int, value: float) -> None:
        stamp_ns = self._time_of(stamp_ns, value)
        self.now_ns = stamp_ns
        self.received(stamp_ns)
        if not self._stamps.is_new(stamp_ns):
            return
        before = self._analyser.reason
        spectrum = self._analyser.add(self._time.since_start(stamp_ns) / 1e9, value)
        if self._analyser.reason != before:
            self.get_logger().warning(
                f'window emptied: {self._analyser.reason}', throttle_duration_sec=QUIET
            )
        if spectrum is not None:
            amplitude, unit = RATE if self.parameters.input_type == IMU else OTHER
            self._spectrum.publish(_array(spectrum, amplitude))
            peaks = _peaks(spectrum, amplitude, unit)
            restamp(peaks.header.stamp, stamp_ns)
            self._peaks.publish(peaks)


def _array(spectrum: Spectrum, amplitude: str) -> Float64MultiArray:
    rows = (spectrum.frequency, spectrum.amplitude, spectrum.phase)
    lines = len(spectrum.frequency)
    message = Float64MultiArray()
    message.layout.dim = [
        MultiArrayDimension(label=f'frequency_hz,{amplitude},phase_rad', size=3, stride=3 * lines),
        MultiArrayDimension(label='line', size=lines, stride=lines),
    ]
    message.data = [value for row in rows for value in row.tolist()]
    return message


def _peaks(spectrum: Spectrum, amplitude: str, unit: str) -> DiagnosticArray:
    return DiagnosticArray(
        status=[
            status(
                peak.label,
                f'{peak.frequency:.2f} Hz, {peak.amplitude:.3f}{unit}',
                {'frequency_hz': repr(peak.frequency), amplitude: repr(peak.amplitude)},
            )
            for peak in spectrum.peaks
        ]
    )
