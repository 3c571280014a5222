"""What was changed from outside: what a graph says once more is no change."""

from khr_bringup.changes import Change, effective
from khr_bringup.scenario.scenario import load_scenario


def test_only_what_gave_a_parameter_another_value_is_a_change():
    scenario = load_scenario('walk_7.68deg_ka12')
    found = [
        Change(1.0, 'ankle_controller', 'gain', 12.0),
        Change(2.0, 'ankle_controller', 'gain', 3.0),
        Change(3.0, 'ankle_controller', 'gain', 3.0),
        Change(4.0, 'ankle_controller', 'gain', 12.0),
        Change(5.0, 'simulator', 'push_point', [0.0, 0.0, 0.0]),
    ]
    assert effective(found, scenario) == (found[1], found[3])
