"""Verbs of bouts."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console

from khr.cli.bout import run_bout
from khr.cli.ros2_command import ros2_command
from khr.cli.summary import print_line
from khr.cli.verbs.options import (
    DomainOption,
    NetworkOption,
    OfflineOption,
    OutOption,
    OwnEngineOption,
    PrintRos2Option,
    ProcessesChoice,
    RecordOption,
    SetOption,
    ViewOption,
    refuse_offline,
    refuse_with_ros2,
)
from khr_bringup.bout.bout import load_bout, shipped_bouts
from khr_bringup.graph.graph import RunOptions
from khr_common.errors import KhrError
from khr_view.viewing import Viewing


def start_bout(
    bout: Annotated[
        str | None, typer.Argument(help='A bout file or name; without one, they are listed.')
    ] = None,
    offline: OfflineOption = False,
    one_process: ProcessesChoice = None,
    engine: OwnEngineOption = None,
    set_: SetOption = None,
    record: RecordOption = True,
    out: OutOption = None,
    domain: DomainOption = None,
    network: NetworkOption = False,
    view: ViewOption = False,
    print_ros2: PrintRos2Option = False,
) -> None:
    """Let two robots fight in one world; keep the bag and trajectory hash of each round."""
    if bout is None:
        for path in shipped_bouts():
            own = load_bout(str(path))
            print_line(Console(), f'{own.name}: {own.title}')
        raise KhrError('bout: no bout given; accepted: one of these, or a bout file')
    of_page = [('--view', view, 'no topics to look at')]
    refuse_offline(offline, one_process, domain, network, of_page)
    settings = [*(set_ or []), *([f'simulator.engine={engine}'] if engine is not None else [])]
    chosen = load_bout(bout)
    chosen = chosen.set_to(settings) if settings else chosen
    if print_ros2:
        refuse_with_ros2(offline, one_process, domain, network, view)
        arguments = {'record': '' if record else 'false', 'out': str(out or '')}
        print(ros2_command(bout, settings, arguments))
        return
    way = RunOptions(offline, one_process is not False, record, domain, network)
    run_bout(chosen, way, out, Viewing() if view else None)
