"""Measure the open loop of a pitch-rate controller, and the gain at which it becomes unstable.

A multisine is added to the joints of a standing robot with the controller in question switched off.
The response of the gyro to it, times the gain and the gain unit, is the gain of the open loop. The
feedback is unstable from the smallest gain at which the open loop is 1 with phase 0.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, floor, pi
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_balance.feedback import rate_gain
from khr_bringup.offline import ControlLoop
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import RunError
from khr_common.interfaces import mix
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import Changes, Condition

Loop = Literal['ankle', 'hip']
JOINTS: dict[Loop, tuple[str, str]] = {
    'ankle': ('l_ankle_pitch', 'r_ankle_pitch'),
    'hip': ('l_hip_pitch', 'r_hip_pitch'),
}
STANDING_DEG = 5.0  # inclination of the ground, less than any limit
SETTLING, WINDOW = 4.0, 3.0  # s before and in the window of the response
LINES = 44  # of the multisine: multiples of 1 / WINDOW, up to 14.7 Hz
AMPLITUDE = 0.02  # rad, root mean square of the multisine
PHASES_SEED = 3  # of the phases of the multisine


class Margin(NamedTuple):
    """The edge of stability of a loop."""

    gain: float  # critical K, in units of the board
    frequency: float  # of the oscillation at that gain, Hz


@dataclass(frozen=True, eq=False)
class OpenLoop:
    """The open loop of a controller at gain K = 1."""

    frequency: NDArray[np.float64]  # Hz, (N,)
    response: NDArray[np.complex128]  # complex gain of the loop, (N,)

    @property
    def smoothed(self) -> NDArray[np.complex128]:
        """Return the response averaged over three lines: friction and backlash scatter it."""
        smooth = np.convolve(self.response, np.ones(3) / 3.0, 'same')
        smooth[[0, -1]] = self.response[[0, -1]]
        return smooth

    def margin(self) -> Margin:
        """Return the edge of stability; NaN if the smoothed phase crosses 0 at no frequency."""
        smooth = self.smoothed
        turns = np.unwrap(np.angle(smooth)) / (2.0 * pi)
        found = [Margin(np.nan, np.nan)]
        for here in range(len(turns) - 1):
            low, high = sorted(turns[here : here + 2])
            for turn in range(ceil(low), floor(high) + 1):
                share = (turn - turns[here]) / ((turns[here + 1] - turns[here]) or 1.0)
                size = np.interp(share, (0.0, 1.0), np.abs(smooth[here : here + 2]))
                at = np.interp(share, (0.0, 1.0), self.frequency[here : here + 2])
                found.append(Margin(float(1.0 / size), float(at)))
        return min(found, key=lambda margin: (np.isnan(margin.gain), margin.gain))


def open_loop(loop: Loop, changes: Changes, ankle_gain: float = 0.0) -> OpenLoop:
    """Measure the open loop of a controller on a standing robot.

    Args:
        ankle_gain: K_A of the closed ankle loop while the hip's is measured; 0 for none.

    Raises:
        RunError: if the robot falls.
    """
    condition = Condition('walk', ankle_gain, changes=changes)
    scenario = condition.scenario(STANDING_DEG).changed({('gait', 'motion'): 'stand'})
    period = scenario.table(RunParameters).control_period
    lines = np.arange(1, LINES + 1) / WINDOW
    samples = round((SETTLING + WINDOW) / period) + 1
    length = round(WINDOW / period)
    time = period * np.arange(samples)
    phases = np.random.default_rng(PHASES_SEED).uniform(0.0, 2.0 * pi, LINES)
    waves = np.cos(2.0 * pi * np.outer(time, lines) + phases)
    added = AMPLITUDE * waves.sum(axis=1) / np.sqrt(LINES / 2.0)
    rates = _rates(scenario.table(RunParameters), ControlLoop(scenario), JOINTS[loop], added)
    if len(rates) < samples:
        raise RunError(f'{loop} loop: the robot fell at {len(rates) * period:.1f} s')
    kernel = np.exp(-2j * pi * np.outer(lines, time[:length]))
    window = slice(samples - length, samples)
    response = (kernel @ rates[window]) / (kernel @ added[window])
    unit, periods = _path(scenario, loop)
    delay = np.exp(-2j * pi * lines * period * periods)
    return OpenLoop(lines, rate_gain(1.0) * unit * response * delay)


def _path(scenario: Scenario, loop: Loop) -> tuple[float, int]:
    """Return the gain unit and the delay in periods of a controller."""
    if loop == 'ankle':
        ankle = scenario.table(AnkleControllerParameters)
        return ankle.gain_unit, ankle.rate_delay
    hip = scenario.table(HipControllerParameters)
    return hip.gain_unit, hip.rate_delay


def _rates(
    parameters: RunParameters,
    loop: ControlLoop,
    joints: tuple[str, str],
    added: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the rate that the gyro reads in each period while angles are added to the joints."""
    duration = (len(added) - 1) * parameters.control_period
    plant = Plant([replace(parameters, duration=duration)])
    rates: list[float] = []
    try:
        (truth,) = plant.start([loop.reference(0.0)])
        for angle in added.tolist():
            target = loop.answer(truth)
            rates.append(loop.pitch_rate)
            if loop.outcome is not None and loop.outcome.fell:
                break
            plant.answer([mix(target, [dict.fromkeys(joints, angle)])])
            if plant.end:
                break
            (truth,) = plant.advance()
    finally:
        plant.close()
    return np.array(rates)
