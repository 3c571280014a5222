"""Robots: named sets of constants, which apply to all parameters that a scenario leaves out.

Each is a ROS 2 parameter file in ``config/robots``; the defaults of the parameter tables are the
robot of a run without a name.
"""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from khr_bringup.scenario.scenario import CONFIG, Scenario, parse
from khr_common.errors import LONGEST, KhrError, quoted
from khr_common.strict_yaml import read_file

ROBOTS = CONFIG / 'robots'


def robot_names() -> list[str]:
    """Return the names of the robots that come with the project."""
    return sorted(path.stem for path in ROBOTS.glob('*.yaml'))


def constants_of(robot: str) -> dict[tuple[str, str], Any]:
    """Return the constants of a robot, by (node, key).

    Args:
        robot: name, or path of a ROS 2 parameter file. The default robot has an empty name and no
            constants here: its values are the defaults of the parameter tables.

    Raises:
        KhrError: if there is no such robot.
    """
    if not robot:
        return {}
    path = Path(robot) if robot.endswith('.yaml') else ROBOTS / f'{robot}.yaml'
    if not path.is_file():
        raise KhrError(
            f'robot: {quoted(robot)}: no such robot; accepted: {", ".join(robot_names())}, or a '
            'ROS 2 parameter file'
        )
    values = parse(read_file(path), str(path), path.stem).values
    return {(node, key): value for node, keys in values.items() for key, value in keys.items()}


def label_of(robot: str) -> str:
    """Return a robot's name for files: a shipped robot's own, or a file's stem with a digest."""
    if not robot.endswith('.yaml'):
        return robot
    path = Path(robot)
    return f'{path.stem}-{sha256(path.read_bytes()).hexdigest()[:8]}'


def on_robot(scenario: Scenario, robot: str) -> Scenario:
    """Return a scenario with the constants of a robot; values of the scenario itself stay."""
    if not robot:
        return scenario
    title = f'{scenario.title or scenario.name}, robot {Path(robot).stem}'
    return replace(scenario.changed(missing_constants(scenario, robot)), title=title[:LONGEST])


def missing_constants(scenario: Scenario, robot: str) -> dict[tuple[str, str], Any]:
    """Return the constants of a robot that a scenario leaves out, by (node, key)."""
    return {
        (node, key): value
        for (node, key), value in constants_of(robot).items()
        if key not in scenario.values.get(node, {})
    }
