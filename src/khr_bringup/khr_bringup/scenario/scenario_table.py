"""Tables that people read: the scenarios, in a terminal and in Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from math import hypot
from typing import Any

from rich.table import Table

from khr_balance.controllers import AnkleControllerParameters, HipControllerParameters
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.scenario.scenario import Scenario
from khr_common.markdown import table
from khr_sim.physics.push import Push
from khr_sim.run_parameters import RunParameters

COLUMNS = ('scenario', 'motion', 'deg', 'surface', 'K_A', 'K_H', 'push')


def scenario_row(scenario: Scenario) -> tuple[str, ...]:
    """Return the distinguishing parameters of a scenario, in the order of COLUMNS."""
    simulator = scenario.table(RunParameters)
    ankle = scenario.table(AnkleControllerParameters)
    hip = scenario.table(HipControllerParameters)
    growth = simulator.inclination_rate_deg_s
    return (
        scenario.name,
        scenario.table(GaitParameters).motion,
        f'{simulator.inclination_deg:g}' + (f' {growth:+g}/s' if growth else ''),
        simulator.surface,
        f'{ankle.gain:g} {ankle.source}{_staged(ankle)}' if ankle.enabled else 'off',
        f'{hip.gain:g}{_staged(hip)}' if hip.enabled else 'off',
        '; '.join(f'{hypot(*Push.parse(push).force):g} N' for push in simulator.pushes if push)
        or '-',
    )


def _staged(controller: Any) -> str:
    return ' staged' if controller.staged else ''


def scenario_table(scenarios: Iterable[Scenario]) -> Table:
    """Return the table that ``khr scenarios`` prints."""
    shown = Table(*COLUMNS, box=None, padding=(0, 1, 0, 0))
    for column in shown.columns:
        column.no_wrap = column.header not in ('K_A', 'K_H')
    for scenario in scenarios:
        shown.add_row(*scenario_row(scenario))
    return shown


def scenario_markdown(scenarios: Iterable[Scenario]) -> str:
    """Return the table of scenarios as Markdown."""
    return table(COLUMNS, map(scenario_row, scenarios))
