"""How the joint's stiffness acts on vibration, a question Dutta (2021), ch. 6, leaves open."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from khr_common.published import GAIT_PERIOD
from khr_models.checks import Array
from khr_models.servo.servo_loop import ServoLoop, Tone, response_by_residues


@dataclass(frozen=True)
class StiffnessSweep:
    """How the joint's stiffness acts on vibration; arrays of one length.

    ``ringing_rate`` is the rms of the ringing part of the pitch rate over a gait cycle, rad/s; it
    is infinite, and ``ringing_frequency`` (Hz) still given, where the loop is unstable.
    ``stability_limit`` is the gain below which the loop is stable, s (N m s/rad as published).
    """

    ringing_frequency: Array
    damping_ratio: Array
    ringing_rate: Array
    stability_limit: Array


def sweep_stiffness(
    loop: ServoLoop, stiffness: Sequence[float] | Array, tone: Tone
) -> StiffnessSweep:
    """Vary a loop's stiffness and measure how it vibrates (Dutta (2021), ch. 6).

    Args:
        loop: gives inertia, damping, gain and form.
        stiffness: the values of K, N m/rad.
        tone: reference of the loop from rest, for instance the gait's fundamental.
    """
    loops = [replace(loop, stiffness=float(value)) for value in stiffness]
    return StiffnessSweep(
        np.array([one.ringing_frequency for one in loops]),
        np.array([one.damping_ratio for one in loops]),
        np.array([_ringing_rate(one, tone) for one in loops]),
        np.array([one.stability_limit for one in loops]),
    )


def _ringing_rate(loop: ServoLoop, tone: Tone) -> float:
    if loop.feedback_damping <= 0.0:
        return math.inf
    time = np.linspace(0.0, GAIT_PERIOD, 2001)
    angular = 2.0 * math.pi * tone.frequency
    steady = (
        loop.gain_at(tone.frequency) * tone.amplitude * np.exp(1j * (angular * time + tone.phase))
    )
    ringing = response_by_residues(loop, [tone], time) - steady.real
    return float(np.sqrt(np.mean(np.gradient(ringing, time) ** 2)))
