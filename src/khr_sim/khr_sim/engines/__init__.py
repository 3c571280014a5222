"""The physics engines: each behind the protocol ``base.Engine``, and named nowhere else."""

from __future__ import annotations

from khr_sim.engines.base import Engine
from khr_sim.parameters import SimulatorParameters
from khr_sim.robot import Robot

LIBRARIES = ('pybullet',)  # that the engines come in, as the package index names them


def create(parameters: SimulatorParameters, robot: Robot) -> Engine:
    """Return an engine of its own for one robot; the engine's library is imported only now."""
    from khr_sim.engines.bullet import Bullet

    return Bullet(parameters, robot)
