"""What the driver of the real robot takes of a scenario, and which nodes run beside it."""

from pathlib import Path

import pytest

from khr_bringup.board_loop import on_board
from khr_bringup.scenario.driver import OF_ROBOT, driver_of
from khr_bringup.scenario.scenario import load_scenario
from khr_common import KhrError
from khr_common.interfaces import FOOT_FORCES, GYRO, ROBOT_DESCRIPTION
from khr_hardware.parameters import BoardParameters

CONTROLLERS = {'ankle_controller', 'hip_controller'}
MIXING = 'board.mixing=board'


def driven(name, *changes):
    """Return a scenario on the board, as khr run --board prepares it."""
    return on_board(load_scenario(name).set_to(changes)).driven_by(driver_of(OF_ROBOT, '--board'))


def without(kind, folder):
    """Return the change to a map that lacks a kind of sensor."""
    file = folder / 'map.yaml'
    sensors = {
        'gyro': 'gyro: {channel: 1, sign: 1, volts_per_rad_s: 0.038}',
        'forces': 'forces: null',
    }
    file.write_text('\n'.join(['servos: khr3hv', *(sensors | {kind: f'{kind}: null'}).values()]))
    return f'board.map={file}'


def test_forces_judge_a_run_and_are_fed_back_where_the_map_has_them():
    scenario = driven('lift_7.6deg_ka12', 'board.map=khr3hv_forces')
    assert set(FOOT_FORCES) <= set(scenario.driver.publishes)
    assert scenario.of('monitor')['judge_by'] == 'sensors' and 'monitor' in scenario.nodes
    with pytest.raises(KhrError, match='ankle_controller needs the topic foot_force/left_toe'):
        driven('lift_7.6deg_ka12')
    assert 'monitor' not in driven('stand_0deg').nodes


def test_without_a_gyro_nothing_claims_a_pitch_rate(tmp_path):
    with pytest.raises(KhrError, match=f'needs the topic {GYRO.name}'):
        driven('walk_6.99deg_ka12', without('gyro', tmp_path))
    with pytest.raises(KhrError, match='mixing: the map has no gyro'):
        driven('walk_6.99deg_ka12', without('gyro', tmp_path), MIXING)


def test_the_description_is_published():
    scenario = driven('stand_0deg')
    assert ROBOT_DESCRIPTION in scenario.driver.publishes
    assert '<robot' in Path(scenario.table(BoardParameters).urdf).read_text()


def test_a_controller_that_the_board_has_no_means_for_is_refused():
    with pytest.raises(KhrError, match='roll_controller: the board cannot do its control'):
        driven('walk_6.99deg_ka12', MIXING, 'roll_controller.enabled=true')
