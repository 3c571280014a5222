"""The FFT analyser node: the spectrum of the torso's pitch rate while the robot moves."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray
from std_msgs.msg import Float64MultiArray, MultiArrayDimension

from khr_analysis.spectrum import FftAnalyserParameters, Spectrum, SpectrumAnalyser
from khr_common.block import NodeSpec
from khr_common.cdr import Floats
from khr_common.interfaces import GYRO, PEAKS, SPECTRUM, Topic
from khr_common.nodes.listener import Listener
from khr_common.nodes.messages import restamp, status
from khr_common.stamps import RunTime, StampSequence

QUIET = 10.0  # s of wall time between warnings


class FftAnalyserNode(Listener):
    """Turn ``imu/data_raw`` into ``spectrum`` and ``spectrum/peaks``.

    ``spectrum`` holds three rows (its first dimension): frequency in Hz, amplitude in rad/s, phase
    in rad (NaN where the amplitude is below the threshold). ``spectrum/peaks`` holds
    one status per peak, the strongest first, named by its label.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._analyser = SpectrumAnalyser(self.parameters)
        self._stamps, self._time = StampSequence(), RunTime()
        self._spectrum = self.publisher(SPECTRUM)
        self._peaks = self.publisher(PEAKS)
        self.subscribe_numbers(GYRO, self._on_gyro)

    def configure(self, parameters: FftAnalyserParameters) -> None:
        """Pass changed parameters to the analyser."""
        self._analyser.configure(parameters)

    def _on_gyro(self, _: Topic, stamp_ns: int, rates: Floats) -> None:
        self.now_ns = stamp_ns
        self.received(stamp_ns)
        if not self._stamps.is_new(stamp_ns):
            return
        before = self._analyser.reason
        spectrum = self._analyser.add(self._time.since_start(stamp_ns) / 1e9, rates[1])
        if self._analyser.reason != before:
            self.get_logger().warning(
                f'window emptied: {self._analyser.reason}', throttle_duration_sec=QUIET
            )
        if spectrum is not None:
            self._spectrum.publish(_array(spectrum))
            peaks = _peaks(spectrum)
            restamp(peaks.header.stamp, stamp_ns)
            self._peaks.publish(peaks)


def _array(spectrum: Spectrum) -> Float64MultiArray:
    rows = (spectrum.frequency, spectrum.amplitude, spectrum.phase)
    lines = len(spectrum.frequency)
    message = Float64MultiArray()
    message.layout.dim = [
        MultiArrayDimension(
            label='frequency_hz,amplitude_rad_s,phase_rad', size=3, stride=3 * lines
        ),
        MultiArrayDimension(label='line', size=lines, stride=lines),
    ]
    message.data = [value for row in rows for value in row.tolist()]
    return message


def _peaks(spectrum: Spectrum) -> DiagnosticArray:
    return DiagnosticArray(
        status=[
            status(
                peak.label,
                f'{peak.frequency:.2f} Hz, {peak.amplitude:.3f} rad/s',
                {'frequency_hz': repr(peak.frequency), 'amplitude_rad_s': repr(peak.amplitude)},
            )
            for peak in spectrum.peaks
        ]
    )
