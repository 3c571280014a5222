"""The command of ROS 2 that starts the same graph as ``khr run``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from shlex import join
from typing import Any

LAUNCH = ('ros2', 'launch', 'khr_bringup', 'balance.launch.py')


def ros2_command(
    scenario: str,
    constants: Mapping[tuple[str, str], Any],
    given: Iterable[str],
    changes: Mapping[tuple[str, str], Any],
    arguments: Mapping[str, str],
) -> str:
    """Return the command line, quoted for a shell.

    Args:
        scenario: its name or file.
        constants: of the robot, by node and parameter.
        given: changes of parameters, as ``node.parameter=value``.
        changes: further ones, by node and parameter.
        arguments: of the launch file, by name; empty ones are left out.
    """
    every = [*_texts(constants), *given, *_texts(changes)]
    stated = {'set': ','.join(every), **arguments}
    words = [
        f'scenario:={scenario}',
        *(f'{name}:={value}' for name, value in stated.items() if value),
    ]
    return join((*LAUNCH, *words))


def _texts(changes: Mapping[tuple[str, str], Any]) -> list[str]:
    return [f'{node}.{key}={value}' for (node, key), value in changes.items()]
