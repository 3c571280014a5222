"""Verbs for a running graph."""

from __future__ import annotations

import sys
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from khr.cli.tables import print_whole
from khr_bringup.graph.live import PATIENCE, LiveParameter, get_parameters
from khr_bringup.graph.live import set_parameter as set_live
from khr_bringup.graph.live import switch_scenario as switch
from khr_bringup.graph.run_registry import RunEntry, choose, running

RunningDomainOption = Annotated[
    int | None,
    typer.Option(
        '--domain',
        help='ROS domain of a running run; by default ROS_DOMAIN_ID, else the only run.',
    ),
]
TimeoutOption = Annotated[
    float, typer.Option(min=0.1, help='Seconds to wait for the node, and for each answer.')
]
NodeArgument = Annotated[
    str,
    typer.Argument(
        help='A node of the running graph; of a bout with its robot, as in red/gait.',
        parser=lambda node: node.lstrip('/'),
    ),
]


def get_parameter(
    node: NodeArgument,
    name: Annotated[
        str | None, typer.Argument(help='A parameter; all of them if left out.')
    ] = None,
    domain: RunningDomainOption = None,
    timeout: TimeoutOption = PATIENCE,
) -> None:
    """Show parameters of a running graph as YAML, with meaning and accepted values.

    All parameters of a node are shown as a parameter file, which khr run takes as a scenario.
    """
    entry = choose(domain)
    found = get_parameters(node, name, entry.domain, timeout)
    indent = ''
    if name is None:
        print(f'{"/" if "/" in node else "/**/"}{node}:\n  ros__parameters:')
        indent = '    '
    for each in found:
        print(f'{indent}{each.name}: {each.as_yaml}{_comment(each)}')
    _name(entry)


def set_parameter(
    node: NodeArgument,
    name: Annotated[str, typer.Argument(help='A parameter.')],
    value: Annotated[str, typer.Argument(help='Its new value.')],
    domain: RunningDomainOption = None,
    timeout: TimeoutOption = PATIENCE,
) -> None:
    """Change a parameter of a running graph; it acts from the next control period."""
    entry = choose(domain)
    before, after = set_live(node, name, value, entry.domain, timeout)
    print(f'{node}.{name}: {before.as_yaml} -> {after.as_yaml}{_comment(after)}')
    _name(entry)


def switch_scenario(
    scenario: Annotated[str, typer.Argument(help='A scenario file or name.')],
    domain: RunningDomainOption = None,
) -> None:
    """Have khr view end its run and start another scenario on the same page."""
    from khr_bringup.scenario.scenario import find_scenario, read_scenario

    chosen = read_scenario(find_scenario(scenario))
    entry = choose(domain)
    print(f'{chosen.name}: takes the place of {switch(chosen, entry.domain)}')


def list_runs() -> None:
    """List your active runs: scenario, ROS domain, state, start time, folder."""
    shown = Table('scenario', 'domain', 'state', 'since', 'folder', box=None, padding=(0, 1, 0, 0))
    for entry in running():
        since = datetime.fromtimestamp(entry.since).strftime('%a %H:%M:%S')
        shown.add_row(
            entry.scenario,
            str(entry.domain),
            entry.state,
            since,
            str(Path(entry.place, entry.folder)),
        )
    if shown.row_count:
        print_whole(shown)
    else:
        print('no run is going on; start one with "khr run SCENARIO"')


def _name(entry: RunEntry) -> None:
    """Report on standard error which run was meant."""
    print(f'khr: {entry.title}', file=sys.stderr)


def _comment(parameter: LiveParameter) -> str:
    return f'  # {parameter.meaning}' if parameter.meaning else ''
