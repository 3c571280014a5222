"""A push is read strictly, and gives the robot in the air the momentum it should."""

import numpy as np
import pytest

from khr_common import KhrError, build
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines import LIBRARIES
from khr_sim.physics.push import Push
from khr_sim.physics.statics import GRAVITY
from tests.fakes.postures import STANCE
from tests.support.mechanics import World, momenta, motions


def test_reads_a_scenario_line():
    text = 't=5.0 link=base_link frame=odom force=8,0,0 point=0,0,0.05 duration=0.1'
    assert Push.parse(text) == Push(
        5.0, 0.1, 'base_link', 'odom', (8.0, 0.0, 0.0), (0.0, 0.0, 0.05)
    )
    assert Push.parse('t=0 link=head frame=head force=1e0,-2,.5 duration=1').point == (0, 0, 0)


@pytest.mark.parametrize(
    ('text', 'says'),
    [
        ('', 't=...'),
        ('t=1 duration=1 link=head frame=odom', 'force=...'),
        ('t=1 t=2 duration=1 link=head frame=odom force=1,0,0', 'once'),
        ('t=1 duration=1 link=head frame=odom force=1,0,0 torque=1', 'torque=1'),
        ('t=1 duration=1 link=head frame=odom force=1,0', 'x,y,z'),
        ('t=one duration=1 link=head frame=odom force=1,0,0', "'one'"),
        ('t=-1 duration=1 link=head frame=odom force=1,0,0', '-1'),
        ('t=1 duration=0 link=head frame=odom force=1,0,0', 'more than 0'),
        ('t=1 duration=1 link=head frame=odom force=inf,0,0', 'inf'),
        ('t=1 duration=1 link=head frame=base_link force=1,0,0', 'odom | head'),
    ],
)
def test_refuses_anything_else_in_one_line(text, says):
    with pytest.raises(KhrError) as refusal:
        Push.parse(text)
    assert says in str(refusal.value)
    assert '\n' not in str(refusal.value)


@pytest.fixture(scope='module', params=LIBRARIES)
def world(request):
    values = {'inclination_deg': 10.0, 'engine': request.param}
    world = World(build(SimulatorParameters, values))
    yield world
    world.close()


PUSHES = [
    ('base_link', 'base_link', (0.01, -0.04, 0.05)),
    ('l_forearm', 'l_forearm', (0.0, 0.0, -0.07)),
    ('imu_link', 'imu_link', (0.0, 0.0, 0.0)),
    ('r_toe', 'odom', (0.0, 0.0, 0.0)),
]


@pytest.mark.parametrize(('link', 'frame', 'point'), PUSHES)
def test_impulse_is_the_change_of_momentum(world, link, frame, point):
    """In one step, so that the arm of the force is known."""
    force = np.array((8.0, 3.0, -2.0))
    start = world.reset(STANCE, clearance=0.5)
    origin, rotation, _, _ = motions(world.robot, start)[link]
    _, _, center = momenta(world.robot, start)
    world.push(Push(0.0, 0.001, link, frame, tuple(force), point))
    period = world.parameters.control_period
    truth = world.advance(STANCE)
    momentum, angular, _ = momenta(world.robot, truth)
    if frame != 'odom':
        force = rotation @ force
    weight = np.array((0.0, 0.0, -GRAVITY * world.robot.mass))
    assert momentum - weight * period == pytest.approx(force * 0.001, abs=4e-5)
    arm = origin + rotation @ point - center
    assert angular == pytest.approx(np.cross(arm, force * 0.001), abs=1e-5)


def test_a_push_lasts_its_duration(world):
    duration = 0.1
    world.reset(STANCE, clearance=0.5)
    world.push(Push(0.02, duration, 'base_link', 'odom', (0.0, 2.0, 0.0)))
    steps = 10
    for _ in range(steps):
        truth = world.advance(STANCE)
    momentum, _, _ = momenta(world.robot, truth)
    assert momentum[1] == pytest.approx(2.0 * duration, rel=1e-3)
    assert not world.bodies[0].pushes  # with any, the world steps one by one


def test_an_unknown_link_is_refused_with_those_there_are(world):
    with pytest.raises(KhrError, match=r'l_ankel.*l_ankle'):
        world.push(Push(0.0, 0.1, 'l_ankel', 'odom', (1.0, 0.0, 0.0)))


def test_a_reset_forgets_pushes(world):
    world.reset(STANCE)
    world.push(Push(0.0, 1.0, 'base_link', 'odom', (0.0, 5.0, 0.0)))
    world.reset(STANCE, clearance=0.5)
    truth = world.advance(STANCE)
    assert momenta(world.robot, truth)[0][1] == pytest.approx(0.0, abs=1e-9)
