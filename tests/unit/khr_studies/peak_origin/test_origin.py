"""Where lines come from: synthetic walks whose makers are known, and white noise."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from khr_common.errors import KhrError
from khr_studies.peak_origin.cycle_spectrum import Record, Treatment, Walks
from khr_studies.peak_origin.origin import count_false_labels, label_peaks, label_strongest
from khr_studies.peak_origin.thesis_peaks import chance_of_distances

PERIOD, CYCLES, SEEDS = 0.015, 4, 3
BASE = Treatment(2.31, 12.0, 0.0, 0.18, 0.1)
LINES = {2: 0.2, 4: 0.25, 6: 0.15, 10: 0.1}  # rad/s, by number
SLIP_HZ = 5.57  # n = 12.87


def loop_frequency(gain):
    return 0.27 * gain  # Hz: 3.24 (n = 7.48) at 12


def walk(treatment, seed, loop, slipping=0.1, noise=0.003):
    """Lines of the gait, a tone of the loop and one of slipping, with phases that drift."""
    draw = np.random.default_rng(seed)
    time = np.arange(round(CYCLES * treatment.cycle_period / PERIOD)) * PERIOD
    cycle = np.floor(time / treatment.cycle_period).astype(int)

    def tone(frequency, wander):
        phase = draw.uniform(0.0, 2 * np.pi) + np.cumsum(wander * draw.normal(size=CYCLES + 1))
        return np.cos(2 * np.pi * frequency * time + phase[cycle])

    rate = noise * draw.normal(size=time.size)
    for number, amplitude in LINES.items():
        rate += amplitude * np.cos(2 * np.pi * number / treatment.cycle_period * time + number)
    if treatment.ankle_gain:
        rate += 0.12 * tone(loop(treatment.ankle_gain), 0.05)
    slides = tone(SLIP_HZ, 0.1) * draw.uniform(0.8, 1.2, CYCLES + 1)[cycle]
    grips = treatment.friction > 0.5
    slip_speed = 0.05 + (0.0 if grips else 0.04) * slides + 0.001 * draw.normal(size=time.size)
    rate += (0.0 if grips else slipping) * slides
    return Record(time, rate, np.cumsum(slip_speed) * PERIOD)


@cache
def walks(label, treatment, loop=loop_frequency, slipping=0.1):
    return Walks(
        label,
        treatment,
        tuple(walk(treatment, seed, loop, slipping) for seed in range(SEEDS)),
        PERIOD,
    )


CHANGES = {
    'K_A 9': {'ankle_gain': 9.0},
    'K_A 18': {'ankle_gain': 18.0},
    'T 2.145': {'cycle_period': 2.145},
    'T 2.55': {'cycle_period': 2.55},
    'no feedback': {'ankle_gain': 0.0},
    'grip': {'friction': 0.8},
}


def others(loop=loop_frequency, slipping=0.1, without=()):
    return [
        walks(label, replace(BASE, **change), loop, slipping)
        for label, change in CHANGES.items()
        if label not in without
    ]


def labelled(loop=loop_frequency, slipping=0.1, without=(), threshold=0.2):
    base = walks('as it is', BASE, loop, slipping)
    return label_peaks(base, others(loop, slipping, without), threshold)


def at(lines, frequency):
    return min(lines, key=lambda line: abs(line.frequency - frequency))


def test_every_maker_is_found_and_nothing_else():
    found = labelled()
    assert [(line.label, line.sure) for line in found if line.origin == 'gait'] == [
        ('gait line 2', 'high'),
        ('f_0', 'high'),
        ('gait line 6', 'high'),
        ('gait line 10', 'high'),
    ]
    line = at(found, 6 / 2.31)
    assert line.amplitude == pytest.approx(LINES[6], abs=0.03)
    assert line.low < line.amplitude < line.high
    rest = [line for line in found if line.origin != 'gait']
    assert [line.origin for line in rest] == ['feedback', 'slipping']
    assert rest[0].frequency == pytest.approx(loop_frequency(12.0), abs=0.03)
    assert rest[1].frequency == pytest.approx(SLIP_HZ, abs=0.06)
    assert rest[0].sure == rest[1].sure == 'high'


@pytest.fixture
def only_the_loop_on_its_line(monkeypatch):
    """Let the loop ring on a line of the gait at K_A 12, and the gait leave that line empty."""

    def prepared(number):
        monkeypatch.setattr(
            f'{__name__}.LINES', {key: value for key, value in LINES.items() if key != number}
        )
        walks.cache_clear()
        return lambda gain: number / 2.31 * gain / 12.0

    yield prepared
    walks.cache_clear()


@pytest.mark.parametrize('number', [6, 17])
def test_a_loop_that_rings_on_a_line_is_distinguished_from_it(only_the_loop_on_its_line, number):
    loop = only_the_loop_on_its_line(number)
    found = at(labelled(loop), number / 2.31)
    assert abs(found.order - number) < 0.05
    assert found.origin == 'feedback' and found.sure != 'low'
    assert found.evidence['place'].speaks_for == {'gait'}
    assert found.evidence['no feedback'].speaks_for == {'feedback'}
    assert found.evidence['cycle'].speaks_against == {'gait'}


def test_a_cycle_whose_lines_coincide_says_nothing(only_the_loop_on_its_line):
    """Line 11 of 2.31 s is line 10 of 2.1 s: that cycle alone cannot tell, and must not veto."""
    loop = only_the_loop_on_its_line(11)
    coinciding = walks('T 2.1', replace(BASE, cycle_period=2.1), loop)
    base, others_ = walks('as it is', BASE, loop), others(loop)

    def cycle(*compared):
        return label_strongest(base, compared, 11 / 2.31, 0.1).evidence.get('cycle')

    assert cycle(coinciding) is None
    assert cycle(coinciding, *others_).speaks_for == {'feedback', 'slipping'}


def invented(rate, seeds=SEEDS):
    """Walks of all treatments whose rate is what a function of treatment, time and draw says."""
    found = []
    for label, change in ({'as it is': {}} | CHANGES).items():
        treatment = replace(BASE, **change)
        time = np.arange(round(CYCLES * treatment.cycle_period / PERIOD)) * PERIOD
        records = []
        for seed in range(seeds):
            draw = np.random.default_rng([seed, len(found)])
            slip = np.cumsum(draw.normal(size=time.size))
            records.append(Record(time, rate(treatment, time, draw), slip))
        found.append(Walks(label, treatment, tuple(records), PERIOD))
    return found


def gait_alone(treatment, time, draw):
    phase = 2 * np.pi * time / treatment.cycle_period
    return 0.05 * draw.normal(size=time.size) + sum(
        amplitude * np.cos(number * phase + number) for number, amplitude in LINES.items()
    )


@pytest.mark.slow
def test_noise_has_hardly_a_peak_and_no_label():
    """One peak in 20 spectra is the stated level; a label must be much rarer."""
    base = invented(lambda treatment, time, draw: draw.normal(size=time.size), seeds=1)
    rates = count_false_labels(base, 0.0, repeats=60)
    assert sum(rates.noise.values()) <= 8  # 3 expected; more than 8 once in 300 times
    assert sum(rates.noise.values()) - rates.noise['unexplained'] <= 2


def test_no_bin_of_noise_is_called_a_line_of_the_gait():
    """Whatever bin one asks for: what does not stand out has no origin."""
    base, *compared = invented(lambda treatment, time, draw: draw.normal(size=time.size))
    asked = [label_strongest(base, compared, n / 2.31, 0.01) for n in range(1, 30)]
    assert [line.label for line in asked] == ['no peak'] * 29
    assert {line.sure for line in asked} == {'low'}


@pytest.mark.slow
def test_a_gait_alone_has_lines_of_the_gait_alone():
    base = invented(gait_alone)
    found = label_peaks(base[0], base[1:], 0.1)
    assert [round(line.order) for line in found] == [2, 4, 6, 10]
    assert {line.origin for line in found} == {'gait'}
    assert not {line.sure for line in found} & {'low'}
    rates = count_false_labels(base, 0.1, repeats=20)
    assert rates.gait['gait'] >= 0.95 * 4 * 20
    assert rates.gait['feedback'] + rates.gait['slipping'] <= 1


def test_a_peak_between_the_lines_is_never_a_line():
    """A tone that nothing takes away has no known origin; it lies on no line of the gait."""

    def tone(treatment, time, draw):
        return gait_alone(treatment, time, draw) + 0.2 * np.cos(2 * np.pi * 2.42 * time)

    base = invented(tone)
    line = at(label_peaks(base[0], base[1:], 0.1), 2.42)
    assert line.frequency == pytest.approx(2.42, abs=0.02) and line.stands
    assert line.origin is None and line.label == 'unexplained' and line.sure == 'low'


def test_one_seed_makes_nothing_quite_sure():
    base, *changed = [
        replace(each, records=each.records[:1]) for each in (walks('as it is', BASE), *others())
    ]
    found = label_peaks(base, changed, 0.2)
    assert found and not any(line.sure == 'high' for line in found)
    gains = [line.evidence['gain'] for line in found if 'gain' in line.evidence]
    assert not any(each.speaks_for for each in gains if 'does not matter' in each.words)


def test_slipping_without_grip_walks_is_not_sure():
    line = at(labelled(without=('grip',)), SLIP_HZ)
    assert 'no slipping' not in line.evidence
    assert at(labelled(), SLIP_HZ).sure == 'high'


def test_slip_that_repeats_with_the_gait_is_no_coherence():
    """Each slips as the next one pitches: the lines are the same, the noise is not."""
    records = invented(gait_alone)[0].records
    slipping = tuple(
        replace(one, slip=np.cumsum(1.0 + other.rate) * PERIOD)
        for one, other in zip(records, (*records[1:], records[0]), strict=True)
    )
    coherence, limit = Walks('', BASE, slipping, PERIOD).slip_coherence(6 / 2.31)
    assert coherence < limit < 0.5


def test_too_short_records_are_refused():
    time = np.arange(100) * PERIOD
    with pytest.raises(KhrError, match='two whole cycles'):
        Walks('', BASE, (Record(time, time, time),), PERIOD)
    with pytest.raises(KhrError, match='one or more'):
        Walks('', BASE, (), PERIOD)


@pytest.mark.parametrize('count', [1, 4])
def test_distances_are_as_probable_as_those_of_random_frequencies(count):
    sums = np.random.default_rng(3).uniform(0.0, 0.5, (200_000, count)).sum(axis=1)
    for distance in np.linspace(0.01, 0.49, 7):
        found = chance_of_distances([distance] * count)
        assert found == pytest.approx(np.mean(sums <= count * distance), abs=0.005)


# ---- statistics on white noise ----

TIME = np.arange(round(CYCLES * BASE.cycle_period / PERIOD)) * PERIOD
FREQUENCIES = np.arange(2, 30) / BASE.cycle_period


def noisy(seed, seeds=3, amplitude=0.0):
    """White noise of deviation 1, in rate and slip speed alike but independent, and a line."""
    draw = np.random.default_rng(seed)
    line = amplitude * np.cos(2 * np.pi * 4 / BASE.cycle_period * TIME)
    records = tuple(
        Record(TIME, line + draw.normal(size=TIME.size), np.cumsum(draw.normal(size=TIME.size)))
        for _ in range(seeds)
    )
    return Walks('', BASE, records, PERIOD)


@pytest.mark.slow
def test_chance_exceeds_the_coherence_limit_once_in_a_hundred_times():
    found = [noisy(seed).slip_coherence(each) for seed in range(50) for each in FREQUENCIES]
    beyond = np.mean([coherence > limit for coherence, limit in found])
    assert beyond == pytest.approx(0.01, abs=0.005)


def test_noise_makes_a_bin_high_as_often_as_its_chance_says():
    """A chance below 5 % is found in 5 % of the bins of white noise, one below 1 % in 1 %."""
    found = [
        drawn.chance(place)
        for drawn in map(noisy, range(40))
        for place in range(10, drawn.frequency.size - 10)
    ]
    assert np.mean(np.array(found) < 0.05) == pytest.approx(0.05, abs=0.006)
    assert np.mean(np.array(found) < 0.01) == pytest.approx(0.01, abs=0.003)


@pytest.mark.parametrize(('away', 'lost'), [(1, False), (6, True), (8, False)])
def test_noise_is_what_lies_within_a_line_and_a_half_but_beside_it(away, lost):
    """Two neighbours stand out: the one does not raise the floor that the other is judged by."""
    first = 4 * CYCLES + 1
    tones = 0.3 * np.sin(2 * np.pi * first / BASE.cycle_period / CYCLES * TIME)
    tones += 10.0 * np.sin(2 * np.pi * (first + away) / BASE.cycle_period / CYCLES * TIME)
    noise = noisy(2).records
    both = Walks('', BASE, tuple(replace(each, rate=each.rate + tones) for each in noise), PERIOD)
    chance = both.chance(first)
    assert chance > 0.5 if lost else chance < 1e-4
    assert both.chance(first + away) < 1e-4


def test_two_cycles_of_one_seed_are_coherent_by_chance_alone():
    half = TIME.size // 2
    (record,) = noisy(3, seeds=1).records
    short = Record(record.time[:half], record.rate[:half], record.slip[:half])
    assert Walks('', BASE, (short,), PERIOD).slip_coherence(FREQUENCIES[0])[1] == 1.0


@pytest.mark.parametrize('amplitude', [0.0, 0.1, 1.0])
def test_what_repeats_is_its_share_of_the_power(amplitude):
    """Of one cycle's coefficient the noise has the power 4/n, n samples; the line a^2."""
    noise = 4.0 / (TIME.size / CYCLES)
    share = noisy(1, seeds=200, amplitude=amplitude).locked_share(4 / BASE.cycle_period)
    assert share == pytest.approx(amplitude**2 / (amplitude**2 + noise), abs=0.03)
