"""Verbs for a graph that runs."""

from __future__ import annotations

from typing import Annotated

import typer

from khr_bringup import scenario as scenarios
from khr_cli.verbs.options import DomainOption


def get_parameter(
    node: Annotated[str, typer.Argument(help='A node of the running graph.')],
    name: Annotated[
        str | None, typer.Argument(help='A parameter; all of them if left out.')
    ] = None,
    domain: DomainOption = None,
) -> None:
    """Show parameters of a running graph."""
    from khr_bringup.live import get_parameters

    for key, value in get_parameters(node, name, domain).items():
        print(f'{key}: {value}')


def set_parameter(
    node: Annotated[str, typer.Argument(help='A node of the running graph.')],
    name: Annotated[str, typer.Argument(help='A parameter.')],
    value: Annotated[str, typer.Argument(help='Its new value.')],
    domain: DomainOption = None,
) -> None:
    """Change a parameter of a running graph; it acts from the next control period."""
    from khr_bringup.live import set_parameter as set_live

    before, after = set_live(node, name, scenarios.parse_value(node, name, value), domain)
    print(f'{node}.{name}: {before} -> {after}')


def switch_scenario(
    scenario: Annotated[str, typer.Argument(help='A scenario file or name.')],
    domain: DomainOption = None,
) -> None:
    """Start a running graph anew with another scenario, taken as a whole or not at all."""
    from khr_bringup.live import switch_scenario as switch

    path = scenarios.find(scenario)
    scenarios.load(str(path))
    print(f'{path.stem}: {switch(path, domain)}')
