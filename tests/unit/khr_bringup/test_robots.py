"""Robots: named constants under the values of a scenario."""

import pytest

from khr_bringup.scenario.robots import constants_of, label_of, on_robot, robot_names
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError


def test_robot_gives_the_parameters_that_the_scenario_leaves_out():
    walk = load_scenario('walk_6.99deg_ka12').changed({('gyro', 'bandwidth'): 3.0})
    assert robot_names() == ['leaning', 'stiff']
    leaning = on_robot(walk, 'leaning')
    assert leaning.of('ankle_controller')['reference_offset'] == -0.7072
    assert leaning.of('gyro')['bandwidth'] == 3.0, 'the scenario states it'
    assert leaning.of('ankle_controller')['gain'] == walk.of('ankle_controller')['gain']
    assert leaning.title.endswith('robot leaning')


def test_robot_is_a_file_as_well_and_an_unknown_one_is_refused(tmp_path):
    file = tmp_path / 'soft.yaml'
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: 20.0\n')
    assert constants_of(str(file)) == {('simulator', 'gear_stiffness'): 20.0}
    label = label_of(str(file))
    with pytest.raises(KhrError, match="'soft': no such robot; accepted: leaning, stiff, or"):
        constants_of('soft')
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: -1.0\n')
    with pytest.raises(KhrError, match=r'soft.yaml: simulator: gear_stiffness: -1.0'):
        constants_of(str(file))
    assert label.startswith('soft-') and label_of(str(file)) != label
    assert label_of('stiff') == 'stiff'
