"""Create a physics engine by its name; other modules know only the protocol ``base.Engine``."""

from __future__ import annotations

import os
from dataclasses import replace

from khr_common.errors import KhrError
from khr_description.robot import Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines.base import Engine, Painter

LIBRARIES = {'bullet': 'pybullet', 'mujoco': 'mujoco'}  # name on PyPI by engine
DEFAULT = SimulatorParameters().engine  # if a scenario names no engine


def create(parameters: SimulatorParameters, robot: Robot) -> Engine:
    """Return the engine named by the parameters; its library is imported here.

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
    """Return the renderer of both engines, PyBullet in software, which needs no graphics driver."""
    from khr_sim.physics.engines.bullet_scene import BulletScene

    return BulletScene(replace(parameters, gui=False), robot)
