"""Statistics of walks over whole cycles: their levels of chance hold on white noise."""

from dataclasses import replace

import numpy as np
import pytest

from khr_studies.peak_origin.cycle_spectrum import Record, Treatment, Walks

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


@pytest.mark.slow
def test_chance_exceeds_the_coherence_limit_once_in_a_hundred_times():
    found = [walks(seed).slip_coherence(each) for seed in range(100) for each in FREQUENCIES]
    beyond = np.mean([coherence > limit for coherence, limit in found])
    assert beyond == pytest.approx(0.01, abs=0.005)


def test_noise_makes_a_bin_high_as_often_as_its_chance_says():
    """A chance below 5 % is found in 5 % of the bins of white noise, one below 1 % in 1 %."""
    found = [
        drawn.chance(place)
        for drawn in map(walks, range(40))
        for place in range(10, drawn.frequency.size - 10)
    ]
    assert np.mean(np.array(found) < 0.05) == pytest.approx(0.05, abs=0.006)
    assert np.mean(np.array(found) < 0.01) == pytest.approx(0.01, abs=0.003)


@pytest.mark.parametrize(('away', 'lost'), [(1, False), (6, True), (8, False)])
def test_noise_is_what_lies_within_a_line_and_a_half_but_beside_it(away, lost):
    """Two neighbours stand out: the one does not raise the floor that the other is judged by."""
    first = 4 * CYCLES + 1
    tones = 0.3 * np.sin(2 * np.pi * first / WALK.cycle_period / CYCLES * TIME)
    tones += 10.0 * np.sin(2 * np.pi * (first + away) / WALK.cycle_period / CYCLES * TIME)
    noise = walks(2).records
    both = Walks('', WALK, tuple(replace(each, rate=each.rate + tones) for each in noise), PERIOD)
    chance = both.chance(first)
    assert chance > 0.5 if lost else chance < 1e-4
    assert both.chance(first + away) < 1e-4


def test_two_cycles_of_one_seed_are_coherent_by_chance_alone():
    half = TIME.size // 2
    (record,) = walks(3, seeds=1).records
    short = Record(record.time[:half], record.rate[:half], record.slip[:half])
    assert Walks('', WALK, (short,), PERIOD).slip_coherence(FREQUENCIES[0])[1] == 1.0


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
