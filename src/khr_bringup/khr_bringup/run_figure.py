"""One picture of a run, from its bag: rate, forces, corrections and spectrum."""

from __future__ import annotations

from pathlib import Path

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes

from khr_analysis.spectrum import Spectrum, spectrum
from khr_bringup.bags import Messages, read_messages, seconds
from khr_bringup.figures import STYLE
from khr_bringup.figures.layout import panels
from khr_bringup.scenario import Scenario

FORCES = {'toe': ('/foot_force/left_toe', '/foot_force/right_toe'),
          'heel': ('/foot_force/left_heel', '/foot_force/right_heel')}
CORRECTIONS = {'ankle': '/ankle_controller/correction', 'hip': '/hip_controller/correction'}
TRUE, GYRO = '/ground_truth/imu', '/imu/data_raw'


def draw_run(bag: Path, scenario: Scenario, path: Path) -> None:
    """Draw the overview of a run as PNG.

    Raises:
        BringupError: if the bag cannot be read.
    """
    messages = read_messages(bag, [TRUE, GYRO, *CORRECTIONS.values(),
                                   *(topic for pair in FORCES.values() for topic in pair)])
    with matplotlib.style.context(STYLE):
        figure, (rate, force, correction, lines) = panels(
            'Pitch rate of the torso', 'Foot forces, both feet', 'Corrections',
            'Spectrum of the gyro', columns=2, height=5.2)
        figure.suptitle(scenario.title or scenario.name, fontsize=10)
        _draw_rates(rate, messages)
        _draw_forces(force, messages)
        _draw_corrections(correction, messages)
        _draw_spectrum(lines, messages, scenario)
        figure.savefig(path)


def _draw_rates(axis: Axes, messages: Messages) -> None:
    for topic, name in ((TRUE, 'true'), (GYRO, 'gyro')):
        axis.plot([seconds(m) for m in messages[topic]],
                  [m.angular_velocity.y for m in messages[topic]], label=name, linewidth=0.8)
    axis.set(xlabel='time, s', ylabel='rad/s, forward positive')
    axis.legend()


def _draw_forces(axis: Axes, messages: Messages) -> None:
    for name, (left, right) in FORCES.items():
        pairs = list(zip(messages[left], messages[right], strict=False))
        axis.plot([seconds(a) for a, _ in pairs],
                  [a.wrench.force.z + b.wrench.force.z for a, b in pairs], label=name,
                  linewidth=0.8)
    axis.set(xlabel='time, s', ylabel='N')
    axis.legend()


def _draw_corrections(axis: Axes, messages: Messages) -> None:
    for name, topic in CORRECTIONS.items():
        axis.plot([seconds(m) for m in messages[topic]],
                  np.degrees([m.position[0] for m in messages[topic]]), label=name, linewidth=0.8)
    axis.set(xlabel='time, s', ylabel='deg')
    axis.legend()


def _draw_spectrum(axis: Axes, messages: Messages, scenario: Scenario) -> None:
    window = _third_cycle(messages, scenario)
    if window is None:
        axis.set_axis_off()
        axis.text(0.0, 0.5, 'too short for a spectrum', transform=axis.transAxes)
        return
    axis.vlines(window.frequency, 0.0, window.amplitude)
    for peak in window.peaks[:4]:
        axis.annotate(f'{peak.frequency:.2f}', (peak.frequency, peak.amplitude), fontsize=7,
                      ha='center', va='bottom')
    axis.set(xlabel=f'frequency, Hz ({window.start:.2f} s to {window.end:.2f} s)',
             ylabel='amplitude, rad/s', ylim=(0.0, None))


def _third_cycle(messages: Messages, scenario: Scenario) -> Spectrum | None:
    """Return the spectrum of a walk's third whole cycle, or of the last window there is."""
    parameters, gait = scenario.table('fft_analyser'), scenario.table('gait')
    rates = [m.angular_velocity.y for m in messages[GYRO]]
    size = parameters.size
    if len(rates) < size:
        return None
    start = len(rates) - size
    if gait.motion == 'walk':
        third = gait.start_delay + 2.5 * gait.cycle_period
        start = min(start, round(third / parameters.control_period))
    return spectrum(rates[start:start + size], parameters, start * parameters.control_period)
