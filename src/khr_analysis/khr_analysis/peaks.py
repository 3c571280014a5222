"""Windows and peaks: amplitude of a tone, and its frequency between two bins.

Each window is a cosine sum. Its transform about a tone is known in closed form, so a tone is
read between the bins by inverting that form, not by fitting a parabola to it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

DOMINANT_SHARE = 0.33  # of the largest amplitude, from which on the thesis counts a peak
ON_LINE = 0.2  # of the distance between two lines of the gait that a peak of it may be off


@dataclass(frozen=True)
class Window:
    """One window function."""

    ripple: float  # amplitude of the cosine relative to the mean of the window
    slope: float  # factor of the interpolation (see offset)
    # transform, relative to its maximum, at a distance in bins of at most 1/2
    lobe: Callable[[float], float]

    def weights(self, size: int) -> Array:
        """Return the periodic window (size,), scaled to a sum of 1."""
        weights = 1.0 - self.ripple * np.cos(2.0 * np.pi * np.arange(size) / size)
        return np.asarray(weights / weights.sum())


WINDOWS = {
    'rectangular': Window(0.0, 1.0, lambda x: float(np.sinc(x))),
    'hann': Window(1.0, 2.0, lambda x: float(np.sinc(x)) / (1.0 - x * x)),
}


@dataclass(frozen=True)
class Peak:
    """One tone: ``amplitude * cos(2 pi frequency (t - start) + phase)``, in Hz and rad.

    ``label`` is ``f_0``, ``harmonic n`` or ``other``; ``bin`` the index of the local maximum.
    """

    frequency: float
    amplitude: float
    phase: float
    label: str
    bin: int

    @property
    def amplitude_deg(self) -> float:
        """Return the amplitude of a tone in rad/s in deg/s."""
        return degrees(self.amplitude)


def find_tones(
    transform: ComplexArray,
    window: Window,
    spacing: float,
    center: float,
    count: int,
    floor: float,
    fundamental: float,
) -> tuple[Peak, ...]:
    """Return the largest local maxima of a spectrum, read between the bins.

    Args:
        transform: (n,) from 0 Hz on, scaled so that a tone's modulus is its amplitude.
        window: the window of the transform.
        spacing: of the bins, Hz.
        center: of the window's weight from the first sample on, in window lengths.
        count: largest number of peaks.
        floor: smallest amplitude of a peak.
        fundamental: f_0, Hz.
    """
    amplitude = np.abs(transform)
    inner = amplitude[1:-1]
    is_peak = (inner > amplitude[:-2]) & (inner >= amplitude[2:]) & (inner >= floor)
    tones = []
    for k in (1 + np.flatnonzero(is_peak)).tolist():
        delta = offset(transform[k - 1 : k + 2], window)
        frequency = (k + delta) * spacing
        # A tone delta bins above the bin turns by 2 pi delta over the window, and the bin gives
        # its phase at the center of the window's weight.
        phase = float(np.angle(transform[k])) - 2.0 * np.pi * delta * center
        tones.append(
            Peak(
                frequency,
                float(abs(transform[k])) / window.lobe(delta),
                float(np.angle(np.exp(1j * phase))),
                label(frequency, fundamental, spacing),
                k,
            )
        )
    return tuple(sorted(tones, key=lambda tone: -tone.amplitude)[:count])


def offset(neighbours: Sequence[complex] | ComplexArray, window: Window) -> float:
    """Return how many bins a single tone lies above the middle one of three bins.

    Jacobsen's estimator: the ratio below is the distance of the tone with the rectangular window
    (lobe W(x) = sin(pi x)/(pi x)), and half of the distance with the Hann window (lobe
    W(x)/(1 - x^2)); ``window.slope`` is the factor. The result is limited to half a bin, which
    only noise or further tones exceed.
    """
    below, at, above = (complex(value) for value in neighbours)
    ratio = (below - above) / (2.0 * at - below - above)
    return max(-0.5, min(0.5, window.slope * ratio.real))


def label(frequency: float, fundamental: float, spacing: float) -> str:
    """Name a frequency by the nearest multiple of f_0, if within half a bin (all in Hz)."""
    n = round(frequency / fundamental)
    if n < 1 or abs(frequency - n * fundamental) > 0.5 * spacing:
        return 'other'
    return 'f_0' if n == 1 else f'harmonic {n}'


def place_in_gait(frequency: float, cycle: float) -> str:
    """Name a frequency as a line n/T of the gait, or as a multiple of 1/T off these lines.

    It names a place, not an origin: two of five frequencies at random are on a line.

    Args:
        frequency: Hz.
        cycle: period T of the gait, s; 0 if the robot does not walk.

    Returns:
        The order n of the line, or the fractional order; empty if the robot does not walk.
    """
    order = frequency * cycle
    if not order:
        return ''
    nearest = round(order)
    if nearest and abs(order - nearest) <= ON_LINE:
        return f'line n = {nearest}'
    return f'off the lines, n = {order:.1f}'
