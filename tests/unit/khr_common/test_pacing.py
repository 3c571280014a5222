"""Whether a run against the wall clock kept up with it."""

import pytest

from khr_common.pacing import Latency, Pace, Punctuality, RealTime

PERIOD = 0.015


def run(steps, factor=1.0):
    """Return what is counted of a run whose periods take ``steps`` s of wall time."""
    kept, now = Punctuality(), 100.0
    kept.tick(now, PERIOD, factor)
    for step in steps:
        now += step
        kept.tick(now, PERIOD, factor)
    return kept


@pytest.mark.parametrize('factor', [0.25, 1.0, 4.0])
def test_periods_in_time_hold_real_time_at_whatever_factor(factor):
    kept = run([PERIOD / factor] * 200, factor).result()
    assert kept.held and not kept.missed
    assert kept.factor == pytest.approx(factor)
    assert RealTime.read(kept.texts()) == RealTime.read(kept.values()) == kept


def test_a_late_period_that_is_made_up_for_is_counted_and_forgiven():
    kept = run([PERIOD] * 99 + [1.9 * PERIOD, 0.1 * PERIOD] + [PERIOD] * 99)
    assert (kept.periods, kept.late, kept.result().held) == (200, 1, True)


@pytest.mark.parametrize(
    'steps',
    [
        [1.02 * PERIOD] * 200,  # no period is late, and yet it falls behind
        ([1.9 * PERIOD, 0.1 * PERIOD] + [PERIOD] * 48) * 4,  # two in a hundred are
    ],
)
def test_what_falls_behind_or_stutters_does_not_hold(steps):
    assert not run(steps).result().held


def test_corrections_too_old_to_use_do_not_hold():
    kept = run([PERIOD] * 200)
    kept.stale = 3
    assert not kept.result().held


def test_a_pause_is_left_out():
    kept = run([PERIOD] * 100)
    kept.rest()
    kept.tick(1e6, PERIOD, 1.0)
    kept.tick(1e6 + PERIOD, PERIOD, 1.0)
    assert (kept.periods, kept.late, kept.result().held) == (101, 0, True)


def test_a_pace_holds_back_and_makes_up_for_no_more_than_a_period():
    pace = Pace()
    assert pace.begins(10.0, 0.5)
    assert pace.begins(10.1, 0.5)
    assert not pace.begins(10.4, 0.5)
    assert pace.begins(10.5, 0.5)
    begun = [now / 100 for now in range(2000, 2200) if pace.begins(now / 100, 0.5)]
    assert begun == [20.0, 20.01, 20.5, 21.0, 21.5]


def test_latencies_are_given_by_their_share():
    latency = Latency()
    assert set(latency.figures().values()) == {''}
    for k in range(100):
        latency.add(0.001 * k)
    assert latency.figures() == {'latency_p50_ms': '49.000', 'latency_p99_ms': '98.000'}
