"""The verbs of the ``khr`` command, in their order."""

from __future__ import annotations

from collections.abc import Callable
from importlib import metadata
from typing import Annotated

import typer

from khr.cli.verbs import board, live, recordings, runs, studies, thesis

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)
VERBS: dict[str, Callable[..., None]] = {
    'run': runs.start_run,
    'view': runs.view,
    'scenarios': runs.list_scenarios,
    'list': live.list_runs,
    'get': live.get_parameter,
    'set': live.set_parameter,
    'switch': live.switch_scenario,
    'doctor': runs.doctor,
    'figure': thesis.figure,
    'reproduce': thesis.reproduce,
    'lines': thesis.lines,
    'push': studies.push,
    'critical': studies.critical,
    'calibrate': studies.calibrate,
    'scoreboard': thesis.scoreboard,
    'engines': studies.engines,
    'tune': studies.tune,
    'stage3': studies.stage3,
    'film': recordings.film,
    'sweep': studies.start_sweep,
    'map': studies.draw_stability_map,
    'report': recordings.report,
    'verify': recordings.verify_bag,
    'recover': recordings.recover_bag,
}


def _show_version(asked: bool) -> None:
    if asked:
        (distribution, *_) = metadata.packages_distributions()['khr']  # the whole, or a part
        print(f'khr {metadata.version(distribution)}')
        raise typer.Exit


@app.callback()
def top(
    version: Annotated[
        bool,
        typer.Option('--version', help='Show the version.', callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Balance control of the KHR-3HV humanoid as a ROS 2 node graph."""


for _name, _verb in VERBS.items():
    app.command(_name)(_verb)
app.add_typer(board.board_verbs(), name='board')
