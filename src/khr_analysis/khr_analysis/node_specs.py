"""The nodes of this package, as the graph knows them."""

from __future__ import annotations

from khr_analysis.outcome import OBSERVED, MonitorParameters
from khr_analysis.recorder_parameters import RecorderParameters
from khr_analysis.spectrum import FftAnalyserParameters
from khr_common.block import NodeSpec
from khr_common.interfaces import (
    DIAGNOSTICS,
    GYRO,
    OF_EVERY_RUN,
    OUTCOME,
    PEAKS,
    READY,
    SPECTRUM,
    STATE,
)

PACKAGE = 'khr_analysis'

FFT_ANALYSER = NodeSpec(
    'fft_analyser',
    PACKAGE,
    FftAnalyserParameters,
    subscribes=(GYRO, STATE),
    publishes=(SPECTRUM, PEAKS, READY),
    node='khr_analysis.nodes.fft_analyser:FftAnalyserNode',
    listens=True,
)
MONITOR = NodeSpec(
    'monitor',
    PACKAGE,
    MonitorParameters,
    subscribes=(*OBSERVED, PEAKS, STATE),
    publishes=(OUTCOME, DIAGNOSTICS, READY),
    node='khr_analysis.nodes.monitor:MonitorNode',
    listens=True,
)
RECORDER = NodeSpec(
    'recorder',
    PACKAGE,
    RecorderParameters,
    subscribes=OF_EVERY_RUN,
    publishes=(DIAGNOSTICS, READY),
    node='khr_analysis.nodes.recorder:RecorderNode',
    listens=True,
)
