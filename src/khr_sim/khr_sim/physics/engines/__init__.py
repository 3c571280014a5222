"""Create a physics engine by its name; other modules know only the protocol ``base.Engine``."""

from __future__ import annotations

import os
from dataclasses import replace
from importlib.util import find_spec

from khr_common.errors import KhrError
from khr_description.robot import Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines.base import Engine, Painter

LIBRARIES = {'bullet': 'pybullet', 'mujoco': 'mujoco'}  # name on PyPI by engine
INSTALLED_BY = {'bullet': 'make bullet', 'mujoco': "pip install 'mujoco<4'"}
DEFAULT = SimulatorParameters().engine  # if a scenario names no engine


def create(parameters: SimulatorParameters, robot: Robot, robots: int = 1) -> Engine:
    """Return the engine named by the parameters, with some robots; its library is imported here.

    Raises:
        KhrError: if the library is not installed, or its window has no screen.
    """
    if parameters.gui and not os.environ.get('DISPLAY'):
        raise KhrError(
            'gui: no screen for the window of the physics engine (DISPLAY is not set); accepted: '
            'false, with khr view in a browser, or a screen'
        )
    check_installed(parameters.engine)
    if parameters.engine == 'bullet':
        from khr_sim.physics.engines.bullet import Bullet

        return Bullet(parameters, robot, robots)
    from khr_sim.physics.engines.mujoco import MuJoCo

    return MuJoCo(parameters, robot, robots)


def check_installed(engine: str) -> None:
    """Check that the library of an engine is installed.

    Raises:
        KhrError: if it is not.
    """
    if find_spec(LIBRARIES[engine]) is None:
        others = [other for other in LIBRARIES if other != engine]
        raise KhrError(
            f'engine: {engine!r} is not installed; accepted: {", ".join(others)}, or {engine} '
            f'after {INSTALLED_BY[engine]}'
        )


def painter(parameters: SimulatorParameters, robot: Robot, robots: int = 1) -> Painter:
    """Return the renderer of both engines, PyBullet in software, which needs no graphics driver.

    Raises:
        KhrError: if PyBullet is not installed.
    """
    check_installed('bullet')
    from khr_sim.physics.engines.bullet_scene import BulletScene

    return BulletScene(replace(parameters, gui=False), robot, robots)
