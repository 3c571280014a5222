"""Which samples of a run its quantities are measured over."""

from types import SimpleNamespace

import numpy as np
import pytest

from khr_analysis.outcome import Outcome
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.derived import start_of_lift
from khr_studies.measuring import bench
from khr_studies.measuring.condition import Condition

PERIOD = 0.015
UPRIGHT = Outcome('walked', 1.0, None, 1.0, 0.0, 0.1, 0.0, 0.0, 0.1)


def shake(monkeypatch, duration, rate):
    """Let each run of the bench be one whose pitch rate is ``rate(time)``, in rad/s."""

    def run(condition, inclination_deg, seed, record):
        for number in range(1, round(duration / PERIOD) + 1):
            time = number * PERIOD
            truth = SimpleNamespace(
                stamp_ns=round(time * 1e9),
                mean_angular_velocity=np.array([0.0, rate(time), 0.0]),
                contact_force=np.ones((4, 3)),
                tilt=0.0,
            )
            record(truth, None, UPRIGHT)
        return UPRIGHT

    monkeypatch.setattr(bench, 'run_condition', run)


@pytest.mark.parametrize('walking_hz', [1.73, 8.0])
def test_vibration_dominates_by_the_samples_of_the_walk_alone(monkeypatch, walking_hz):
    condition = Condition('walk')
    gait = condition.scenario(5.0).table(GaitParameters)
    end = gait_of(gait).duration

    def rate(time):
        rings = time > end - gait.end_pause
        return np.sin(2 * np.pi * (8.0 if rings else walking_hz) * time) * (9.0 if rings else 1.0)

    shake(monkeypatch, end, rate)
    assert bench.walk(condition, 5.0, 0)['dominated'] == (walking_hz == 8.0)


def test_the_overshoot_of_a_lift_ends_when_the_foot_is_lowered(monkeypatch):
    condition = Condition('leg_lift')
    gait = condition.scenario(3.0).table(GaitParameters)
    begin = start_of_lift(3.0)
    lowered = begin + gait.shift_time + gait.lift_time + gait.hold_time
    heights = {begin - 0.1: 5.0, lowered - 0.1: -2.0, lowered + 0.1: 3.0}

    def rate(time):
        return next((h for at, h in heights.items() if abs(time - at) < PERIOD), 0.5)

    shake(monkeypatch, lowered + 2.0, rate)
    assert bench.lift(condition, 3.0, 0)['overshoot_rad_s'] == pytest.approx(2.0)
