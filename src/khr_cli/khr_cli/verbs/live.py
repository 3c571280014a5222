"""Verbs for a graph that runs."""

from __future__ import annotations

from typing import Annotated

import typer

from khr_bringup import scenario as scenarios
from khr_bringup.live import PATIENCE, LiveParameter, get_parameters
from khr_bringup.live import set_parameter as set_live
from khr_bringup.live import switch_scenario as switch

RunningDomainOption = Annotated[
    int | None,
    typer.Option(
        '--domain', help='ROS domain of the run; the only one by default, or as ROS_DOMAIN_ID.'
    ),
]
TimeoutOption = Annotated[
    float, typer.Option(min=0.1, help='Seconds to wait for the node, and for each answer.')
]


def get_parameter(
    node: Annotated[str, typer.Argument(help='A node of the running graph.')],
    name: Annotated[
        str | None, typer.Argument(help='A parameter; all of them if left out.')
    ] = None,
    domain: RunningDomainOption = None,
    timeout: TimeoutOption = PATIENCE,
) -> None:
    """Show parameters of a running graph, what they mean and accept, as YAML."""
    for each in get_parameters(node, name, domain, timeout):
        print(f'{each.name}: {each.shown}{_comment(each)}')


def set_parameter(
    node: Annotated[str, typer.Argument(help='A node of the running graph.')],
    name: Annotated[str, typer.Argument(help='A parameter.')],
    value: Annotated[str, typer.Argument(help='Its new value.')],
    domain: RunningDomainOption = None,
    timeout: TimeoutOption = PATIENCE,
) -> None:
    """Change a parameter of a running graph; it acts from the next control period."""
    typed = scenarios.parse_value(node, name, value)
    before, after = set_live(node, name, typed, domain, timeout)
    print(f'{node}.{name}: {before.shown} -> {after.shown}{_comment(after)}')


def switch_scenario(
    scenario: Annotated[str, typer.Argument(help='A scenario file or name.')],
    domain: RunningDomainOption = None,
) -> None:
    """Start a running graph anew with another scenario, taken as a whole or not at all."""
    path = scenarios.find(scenario)
    scenarios.load(str(path))
    print(f'{path.stem}: {switch(path, domain)}')


def _comment(parameter: LiveParameter) -> str:
    return f'  # {parameter.meaning}' if parameter.meaning else ''
