"""Specifications of the nodes of this package for the graph."""

from __future__ import annotations

from khr_analysis.outcome import OBSERVED, SENSED, MonitorParameters
from khr_analysis.recorder_parameters import OF_EVERY_RUN, RecorderParameters
from khr_analysis.referee import RefereeBlock, RefereeParameters
from khr_analysis.run_phase import RunPhaseParameters
from khr_analysis.spectrum import FftAnalyserParameters
from khr_common.block import NodeSpec
from khr_common.interfaces import (
    CLOCK,
    DECIDED,
    DECISION,
    DIAGNOSTICS,
    GYRO,
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
    subscribes=(*OBSERVED, *SENSED, PEAKS, STATE),
    publishes=(OUTCOME, DIAGNOSTICS, READY),
    node='khr_analysis.nodes.monitor:MonitorNode',
    listens=True,
)
RUN_PHASE = NodeSpec(
    'run_phase',
    PACKAGE,
    RunPhaseParameters,
    subscribes=(CLOCK,),
    publishes=(STATE, DIAGNOSTICS),
    node='khr_analysis.nodes.run_phase:RunPhaseNode',
    joins=lambda _: False,  # only with a driver that does not report the state of its run
)
REFEREE = NodeSpec(
    'referee',
    PACKAGE,
    RefereeParameters,
    RefereeBlock,
    publishes=(DECIDED, DECISION),
    node='khr_analysis.nodes.referee:RefereeNode',
    joins=lambda _: False,  # only in a bout
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
