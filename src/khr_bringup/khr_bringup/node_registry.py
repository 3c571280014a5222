"""Which node has which parameter table, without ROS."""

from __future__ import annotations

from typing import Any

from khr_analysis.outcome import MonitorParameters
from khr_analysis.recording import RecorderParameters
from khr_analysis.spectrum import FftAnalyserParameters
from khr_balance.ankle import AnkleControllerParameters
from khr_balance.gait_parameters import GaitParameters
from khr_balance.hip import HipControllerParameters
from khr_balance.stage import StageParameters
from khr_sim.foot_force import FootForceParameters
from khr_sim.gyro import GyroParameters
from khr_sim.run_parameters import RunParameters

TABLES: dict[str, type[Any]] = {
    'simulator': RunParameters,
    'gyro': GyroParameters,
    'foot_force': FootForceParameters,
    'gait': GaitParameters,
    'stage': StageParameters,
    'ankle_controller': AnkleControllerParameters,
    'hip_controller': HipControllerParameters,
    'fft_analyser': FftAnalyserParameters,
    'monitor': MonitorParameters,
    'recorder': RecorderParameters,
}

PACKAGES: dict[str, str] = {
    'simulator': 'khr_sim',
    'gyro': 'khr_sim',
    'foot_force': 'khr_sim',
    'gait': 'khr_balance',
    'stage': 'khr_balance',
    'ankle_controller': 'khr_balance',
    'hip_controller': 'khr_balance',
    'fft_analyser': 'khr_analysis',
    'monitor': 'khr_analysis',
    'recorder': 'khr_analysis',
}
