"""Worlds of both engines."""

import pytest

from khr_common import build
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines import LIBRARIES
from tests.support.mechanics import World


@pytest.fixture(params=LIBRARIES)
def world_with(request):
    worlds = []

    def make(**values):
        worlds.append(World(build(SimulatorParameters, {'engine': request.param} | values)))
        return worlds[-1]

    yield make
    for world in worlds:
        world.close()
