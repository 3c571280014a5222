"""Robots: named constants under the values of a scenario."""

import pytest

from khr_bringup.offline import run_offline
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
    with pytest.raises(KhrError, match="'soft': no such robot; accepted: leaning, stiff, or"):
        constants_of('soft')
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: -1.0\n')
    with pytest.raises(KhrError, match=r'soft.yaml: simulator: gear_stiffness: -1.0'):
        constants_of(str(file))


@pytest.mark.slow
def test_feedback_raises_the_vibration_of_the_default_robot():
    def vibration(gain):
        changes = ['simulator.inclination_deg=5.55', f'ankle_controller.gain={gain}']
        walk = load_scenario('walk_8.88deg_ka12').set_to([*changes, 'simulator.engine=mujoco'])
        outcome = run_offline(walk).outcome
        assert outcome.stayed_up
        return outcome.vibration

    assert vibration(0.0) < vibration(12.0) < 0.9 * vibration(18.0)


def test_a_file_has_a_label_by_its_content_and_a_shipped_robot_its_name(tmp_path):
    file = tmp_path / 'soft.yaml'
    file.write_text('simulator:\n  ros__parameters:\n    gear_stiffness: 20.0\n')
    first = label_of(str(file))
    file.write_text(file.read_text().replace('20', '21'))
    assert first.startswith('soft-') and label_of(str(file)) != first
    assert label_of('stiff') == 'stiff'
