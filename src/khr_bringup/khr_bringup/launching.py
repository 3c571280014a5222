"""What the arguments of the launch file ask for; nothing here imports ``launch``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp

from khr_bringup import scenario as scenarios
from khr_bringup.code_version import as_run
from khr_bringup.errors import BringupError
from khr_bringup.expectation import MEANING, Expectation
from khr_bringup.following import nodes_of
from khr_bringup.graph import prepare
from khr_bringup.node_registry import spec_of
from khr_bringup.offline import duration
from khr_common.files import write_text

# The launch file's arguments: default and meaning of each.
ARGUMENTS = {
    'scenario': ('walk_7.68deg_ka12', 'A scenario of khr_bringup/config, or a file.'),
    'duration': ('', 'Simulated seconds; the length of the motion by default.'),
    'sync': ('', 'lockstep or realtime; that of the scenario by default.'),
    'realtime_factor': ('', 'Simulated by wall time with sync:=realtime.'),
    'seed': ('', 'Seed of all that is drawn at random; that of the scenario by default.'),
    'set': ('', 'Further changes: node.parameter=value,node.parameter=value'),
    'expect': ('', MEANING),
    'record': ('true', 'Write a bag.'),
    'out': ('', 'Folder of the run, new or empty; a temporary one by default.'),
    'namespace': ('', 'Namespace of all nodes, for a second robot.'),
    'rviz': ('false', 'Show the robot in RViz, if it is installed.'),
}
OF_SIMULATOR = ('duration', 'sync', 'realtime_factor', 'seed')


@dataclass(frozen=True)
class Launch:
    """A launch that can begin.

    Attributes:
        scenario: name of the scenario.
        folder: of the run.
        parameters: the parameter file, for all nodes.
        nodes: package and name of each.
        expect: what is expected of the run; empty if nothing is.
        rviz: whether to show the robot.
    """

    scenario: str
    folder: Path
    parameters: Path
    nodes: tuple[tuple[str, str], ...]
    expect: str
    rviz: bool


def arrange(given: Mapping[str, str], joints: bool = True) -> Launch:
    """Write the parameter file that a launch needs.

    Args:
        given: the launch file's arguments.
        joints: whether the node ``transforms`` is to publish the joints' frames.

    Raises:
        BringupError: if one is not accepted.
    """
    record, rviz = (_switch(name, given[name]) for name in ('record', 'rviz'))
    changes = dict(
        scenarios.parse_change(f'simulator.{name}={given[name]}')
        for name in OF_SIMULATOR
        if given[name]
    )
    scenario = scenarios.load(given['scenario']).changed(changes).set_to(_parted(given['set']))
    scenario = scenario.changed(
        {('simulator', 'duration'): duration(scenario), ('transforms', 'joints'): joints}
    )
    Expectation.parse(given['expect'], 'expect', scenario)  # refused before anything starts
    folder = _folder(given['out'], scenario.name)
    prepared = prepare(scenario, folder, record)
    parameters = folder / 'scenario.yaml'
    write_text(parameters, as_run(prepared))
    nodes = tuple((spec_of(node).package, node) for node in nodes_of(scenario, record))
    return Launch(scenario.name, folder, parameters, nodes, given['expect'], rviz)


def _switch(name: str, text: str) -> bool:
    if text.lower() not in ('true', 'false'):
        raise BringupError(f'{name}: {text!r} is not accepted; accepted: true | false')
    return text.lower() == 'true'


def _parted(text: str) -> list[str]:
    """Return the changes of a list; a value may hold commas itself."""
    return [part for part in re.split(r',(?=\s*\w+\.\w+=)', text) if part.strip()]


def _folder(out: str, name: str) -> Path:
    folder = Path(out or mkdtemp(prefix=f'{name}-')).absolute()
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise BringupError(f'out: {out!r} holds something; accepted: a new or empty folder')
    folder.mkdir(parents=True, exist_ok=True)
    return folder
