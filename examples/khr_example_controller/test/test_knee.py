"""The law of the knees: nothing below the dead band, in proportion above it, limited."""

from dataclasses import replace
from math import radians

import pytest

from khr_common.interfaces import GYRO
from khr_example_controller.knee import KneeController, KneeControllerParameters

ON = KneeControllerParameters(enabled=True, gain=6.0, gain_unit=1.0)


def knees(rate, parameters=ON):
    (angles,) = KneeController(parameters).update(0.0, {GYRO: (0.0, rate, 0.0)})
    return angles


@pytest.mark.parametrize('rate', [-1.0, 0.0, 0.1])
def test_nothing_below_the_dead_band(rate):
    assert knees(rate) == (0.0, 0.0)


def test_in_proportion_above_it():
    assert knees(0.3)[0] == pytest.approx(2.0 * knees(0.2)[0])
    assert knees(0.2)[0] > 0.0
    assert knees(0.2, replace(ON, gain_unit=0.5))[0] == 0.5 * knees(0.2)[0]


def test_limited_and_off():
    assert knees(100.0) == (radians(ON.limit_deg),) * 2
    assert knees(1.0, KneeControllerParameters()) == (0.0, 0.0)
