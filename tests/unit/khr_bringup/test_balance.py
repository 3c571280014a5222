"""Centre of mass, capture point and centre of pressure against toe and heel edge."""

from math import isnan, pi, sqrt

import pytest

from khr_bringup.balance import BalanceModel
from khr_common.interfaces import JOINTS
from khr_common.rotation import matrix, pitch_of, pitched, quaternion, rotated
from khr_description.robot import Robot
from khr_sim.physics.statics import GRAVITY
from khr_sim.run_parameters import RunParameters

ROBOT = Robot.load()
MODEL = BalanceModel(ROBOT, RunParameters())
STRAIGHT = (0.0,) * len(JOINTS)
EVEN = (4.0,) * 4


def at(inclination=0.0, forces=EVEN, ahead=0.0, before=None, period=0.0):
    """The robot normal to a slope, its soles' middle at the origin, or moved along x."""
    poses = ROBOT.poses(STRAIGHT)
    middle = (poses['l_sole'][:3, 3] + poses['r_sole'][:3, 3]) / 2.0
    turn = pitched(inclination)
    place = -matrix(turn) @ middle + (ahead, 0.0, 0.0)
    return MODEL.at((*place, *turn), STRAIGHT, inclination, forces, before, period)


@pytest.mark.parametrize('inclination', [-0.1, 0.0, 0.2])
def test_the_edges_are_those_of_the_soles_on_every_slope(inclination):
    margins = at(inclination).margins
    length = ROBOT.joints['l_toe_frame'].origin[0] - ROBOT.joints['l_heel_frame'].origin[0]
    assert margins.toe - margins.heel == pytest.approx(length)
    assert margins.toe == pytest.approx(-margins.heel)
    assert abs(margins.pressure) < 1e-9, 'equal forces at toe and heel'


def test_the_pressure_is_where_the_load_is():
    toes, heels = at(forces=(5.0, 0.0, 5.0, 0.0)).margins, at(forces=(0.0, 5.0, 0.0, 5.0)).margins
    assert (toes.pressure, heels.pressure) == pytest.approx((toes.toe, heels.heel))
    left = at(forces=(5.0, 5.0, 0.0, 0.0)).pressure
    assert left[1] == pytest.approx(ROBOT.poses(STRAIGHT)['l_sole'][1, 3])


def test_downhill_the_centre_of_mass_is_nearer_to_the_toes():
    assert at(0.2).margins.center > at(0.0).margins.center > at(-0.2).margins.center


def test_the_capture_point_runs_ahead_of_a_moving_robot():
    speed, period = 0.2, 0.015
    now = at(ahead=speed * period, before=at(), period=period)
    lead = now.margins.capture - now.margins.center
    assert lead == pytest.approx(speed * sqrt(now.center_of_mass[2] / GRAVITY))
    assert at().margins.capture == at().margins.center


@pytest.mark.parametrize('heading', [pi / 2.0, pi, -2.0])
@pytest.mark.parametrize('lean', [-1.7, -0.3, 0.4, 1.7])
def test_lean_and_margins_are_in_the_heading_of_the_robot(heading, lean):
    def toppling(heading):
        found = None
        for angle in (lean - 0.01, lean):
            turn = matrix(rotated((0.0, 0.0, heading))) @ matrix(pitched(angle))
            pose = (*(turn @ (0.0, 0.0, 0.3)), *quaternion(turn))
            found = MODEL.at(pose, STRAIGHT, 0.0, EVEN, found, 0.015)
        assert pitch_of(*pose[3:]) == pytest.approx(lean)
        return found.margins

    assert toppling(heading) == pytest.approx(toppling(0.0))


def test_in_the_air_there_are_no_margins():
    assert all(map(isnan, at(forces=(0.0,) * 4).margins))
