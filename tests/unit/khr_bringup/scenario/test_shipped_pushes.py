"""Pushes that a shipped scenario lists happen before its run is over."""

import pytest

from khr_bringup.offline import duration
from khr_bringup.scenario import scenario as scenarios
from khr_sim.physics.push import Push
from khr_sim.run_parameters import RunParameters

PUSHED = [path for path in scenarios.shipped() if 'push' in path.stem]


@pytest.mark.parametrize('path', PUSHED, ids=lambda path: path.stem)
def test_a_push_ends_seconds_before_the_run(path):
    scenario = scenarios.load_scenario(str(path))
    pushes = [Push.parse(text) for text in scenario.table(RunParameters).pushes if text]
    assert pushes
    assert max(push.start + push.duration for push in pushes) + 2.0 < duration(scenario)
