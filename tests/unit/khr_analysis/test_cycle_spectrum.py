"""Statistics of walks over whole cycles: their levels of chance hold on white noise."""

import numpy as np
import pytest

from khr_analysis.cycle_spectrum import Record, Treatment, Walks

PERIOD, CYCLES = 0.015, 4
WALK = Treatment(2.31, 12.0, 0.0, 0.18, 0.1)
TIME = np.arange(round(CYCLES * WALK.cycle_period / PERIOD)) * PERIOD
FREQUENCIES = np.arange(2, 30) / WALK.cycle_period


def walks(seed, seeds=3, amplitude=0.0):
    """White noise of deviation 1, in rate and slip speed alike but independent, and a line."""
    draw = np.random.default_rng(seed)
    line = amplitude * np.cos(2 * np.pi * 4 / WALK.cycle_period * TIME)
    records = tuple(
        Record(TIME, line + draw.normal(size=TIME.size), np.cumsum(draw.normal(size=TIME.size)))
        for _ in range(seeds)
    )
    return Walks('', WALK, records, PERIOD)


def test_chance_exceeds_the_coherence_limit_once_in_a_hundred_times():
    found = [walks(seed).slip_coherence(each) for seed in range(100) for each in FREQUENCIES]
    beyond = np.mean([coherence > limit for coherence, limit in found])
    assert beyond == pytest.approx(0.01, abs=0.005)


def test_of_noise_nothing_repeats():
    """The estimate is cut at 0, which keeps its mean a little above; many seeds bring it down."""
    shares = [
        walks(seed, seeds=60).locked_share(each) for seed in range(3) for each in FREQUENCIES
    ]
    assert np.mean(shares) < 0.04


@pytest.mark.parametrize('amplitude', [0.05, 0.1, 0.2, 1.0])
def test_what_repeats_is_its_share_of_the_power(amplitude):
    """Of one cycle's coefficient the noise has the power 4/n, n samples; the line a^2."""
    noise = 4.0 / (TIME.size / CYCLES)
    share = walks(1, seeds=200, amplitude=amplitude).locked_share(4 / WALK.cycle_period)
    assert share == pytest.approx(amplitude**2 / (amplitude**2 + noise), abs=0.03)
