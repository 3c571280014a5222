"""The command of ROS 2 that starts the same graph as ``khr run``."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from shlex import join
from typing import Any

LAUNCH = ('ros2', 'launch', 'khr_bringup', 'balance.launch.py')


def ros2_command(scenario: str, settings: Iterable[str], arguments: Mapping[str, str]) -> str:
    """Return the command line, quoted for a shell.

    Args:
        scenario: its name or file.
        settings: changes of parameters, as ``node.parameter=value``; the last of each counts.
        arguments: of the launch file, by name; empty ones are left out.
    """
    stated = {'set': ','.join(settings), **arguments}
    words = [
        f'scenario:={scenario}',
        *(f'{name}:={value}' for name, value in stated.items() if value),
    ]
    return join((*LAUNCH, *words))


def settings_text(changes: Mapping[tuple[str, str], Any]) -> list[str]:
    """Return changes by node and parameter as ``node.parameter=value``."""
    return [f'{node}.{key}={value}' for (node, key), value in changes.items()]
