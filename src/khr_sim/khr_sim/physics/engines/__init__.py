"""The physics engines: each behind the protocol ``base.Engine``, and named nowhere else."""

from __future__ import annotations

import os
from dataclasses import replace

from khr_common.errors import KhrError
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines.base import Engine, Painter
from khr_sim.robot import Robot

LIBRARIES = {'bullet': 'pybullet', 'mujoco': 'mujoco'}  # by engine, as the package index has them
DEFAULT = SimulatorParameters().engine  # of a scenario that names none


def create(parameters: SimulatorParameters, robot: Robot) -> Engine:
    """Return the engine that the parameters ask for, and import its library only now.

    Raises:
        KhrError: if the library is not installed, or its window has no screen.
    """
    if parameters.gui and not os.environ.get('DISPLAY'):
        raise KhrError(
            'gui: no screen for the window of the physics engine (DISPLAY is not set); accepted: '
            'false, with khr view in a browser, or a screen'
        )
    if parameters.engine == 'bullet':
        from khr_sim.physics.engines.bullet import Bullet

        return Bullet(parameters, robot)
    try:
        from khr_sim.physics.engines.mujoco import MuJoCo
    except ModuleNotFoundError as error:
        if error.name != LIBRARIES['mujoco']:
            raise
        raise KhrError(
            "engine: 'mujoco' is not installed; accepted: bullet, or mujoco after "
            "pip install 'mujoco<4'"
        ) from error
    return MuJoCo(parameters, robot)


def painter(parameters: SimulatorParameters, robot: Robot) -> Painter:
    """Return what draws the robot, of whichever engine: the one that needs no graphics driver."""
    from khr_sim.physics.engines.bullet_scene import BulletScene

    return BulletScene(replace(parameters, gui=False), robot)
