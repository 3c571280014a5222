"""Two robots on one plane: they meet, and otherwise each is the robot that it is alone."""

from dataclasses import replace
from itertools import pairwise
from math import pi

import numpy as np
import pytest

from khr_common import build
from khr_sim.physics.body import Start
from khr_sim.physics.engines import LIBRARIES
from khr_sim.physics.push import Push
from khr_sim.physics.statics import GRAVITY
from khr_sim.physics.world import World
from khr_sim.plant import Plant
from khr_sim.run_parameters import RunParameters
from tests.fakes.postures import STANCE, crouch
from tests.support.mechanics import ground_forces, momenta

PERIOD = 0.015
FROM_BEHIND = Push(0.15, 0.3, 'base_link', 'odom', (14.0, 0.0, 0.0), (0.0, 0.0, 0.05))

FROM_FRONT = replace(FROM_BEHIND, force=(-14.0, 0.0, 0.0))


@pytest.fixture(params=LIBRARIES)
def face_to_face(request):
    """Return a function that makes a world of two robots that face each other."""
    worlds = []

    def make(gap, robots=2, **values):
        p = build(RunParameters, {'engine': request.param, 'surface': 'rubber'} | values)
        starts = (Start(-gap / 2.0), Start(gap / 2.0, 0.0, pi))[:robots]
        worlds.append(World([p] * robots, starts))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()


def play(world, seconds, push=None, posture=STANCE):
    """Return the states of the robots in each period; the first robot is pushed."""
    postures = [posture] * len(world.bodies)
    states = [world.reset(postures)]
    if push is not None:
        world.push(push)
    states += [world.advance(postures) for _ in range(round(seconds / PERIOD))]
    return states


def test_a_robot_out_of_reach_falls_as_one_that_is_alone(face_to_face):
    (alone,) = play(face_to_face(4.0, robots=1), 1.8, FROM_BEHIND)[-1]
    one, other = play(face_to_face(4.0), 1.8, FROM_BEHIND)[-1]
    assert alone.tilt > 1.2
    assert one.tilt == pytest.approx(alone.tilt, abs=0.02)
    assert one.position == pytest.approx(alone.position, abs=0.01)
    assert other.tilt < 0.2


def test_the_boxes_of_the_legs_meet_other_robots_only(face_to_face):
    """A robot that falls on its seat lies as one that is alone, without these boxes."""
    seated = crouch(-86.0, 17.0, 0.0)
    alone, one = (play(face_to_face(4.0, n), 3.0, FROM_FRONT, seated)[-1][0] for n in (1, 2))
    assert one.tilt == pytest.approx(alone.tilt, abs=0.02)
    assert one.position == pytest.approx(alone.position, abs=0.01)


def test_robots_that_meet_exchange_momentum_and_make_none(face_to_face):
    world = face_to_face(0.2, friction=0.3)
    weight = np.array((0.0, 0.0, -GRAVITY * world.robot.mass))
    states = play(world, 0.75, FROM_BEHIND)
    given = 0.0
    for k, (before, after) in enumerate(pairwise(states)):
        changes = [
            momenta(world.robot, new)[0] - momenta(world.robot, old)[0]
            for old, new in zip(before, after, strict=True)
        ]
        acting = [ground_forces(truth).sum(axis=0) + weight for truth in after]
        acting[0] = acting[0] + np.array(FROM_BEHIND.force) * (10 <= k < 30)
        if any(truth.tilt > 0.8 for truth in after):  # arms may reach the ground
            break
        assert sum(changes) == pytest.approx(sum(acting) * PERIOD, abs=6e-3)
        given += (changes[1] - acting[1] * PERIOD)[0]
    assert given > 0.3  # N s, which the first has given the second


def test_feet_meet_feet(face_to_face):
    """Toe to toe the torsos are apart; on ice the first moves the second."""
    world = face_to_face(0.12, friction=0.01)
    slow = Push(0.0, 2.0, 'base_link', 'odom', (0.18, 0.0, 0.0), (0.0, 0.0, -0.2))
    states = play(world, 1.2, slow)
    red, blue = states[-1]
    assert blue.position[0] - red.position[0] > 0.1
    assert blue.position[0] - states[0][1].position[0] > 0.005


@pytest.mark.parametrize('engine', LIBRARIES)
def test_a_plant_of_two_repeats_its_hash_and_counts_each_robot(engine):
    own = replace(RunParameters(), engine=engine, duration=0.3)
    pushed = replace(own, pushes=('t=0 duration=0.1 link=base_link frame=odom force=5,0,0',))

    def hash_of(*parameters):
        plant = Plant(parameters, (Start(-0.3), Start(0.3, 0.0, pi)))
        hashes = []
        for _ in range(2):
            plant.start([STANCE, STANCE])
            while not plant.end:
                plant.answer([STANCE, STANCE])
                plant.advance()
            hashes.append(plant.trajectory_hash)
        plant.close()
        assert hashes[0] == hashes[1]
        return hashes[0]

    assert len({hash_of(own, own), hash_of(pushed, own), hash_of(own, pushed)}) == 3
