"""Verbs of bouts."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from khr.cli.ros2_command import ros2_command
from khr.cli.run import NETWORK
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
    refuse_offline,
)
from khr.progress import show_run
from khr_analysis.referee import DRAW
from khr_bringup.bout.bout import load_bout, shipped_bouts
from khr_bringup.bout.fight import BoutResult
from khr_bringup.bout.running import run_to_decision
from khr_bringup.graph.following import Callbacks
from khr_bringup.graph.graph import RunOptions
from khr_bringup.graph.run_registry import RunEntry, check_domain
from khr_bringup.run_folder import claim_folder
from khr_common.errors import KhrError
from khr_sweeps.progress import ProgressBar


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
    print_ros2: PrintRos2Option = False,
) -> None:
    """Let two robots fight in one world; keep the bag and trajectory hash of each round."""
    console = Console(stderr=True)
    if bout is None:
        for path in shipped_bouts():
            own = load_bout(str(path))
            print_line(Console(), f'{own.name}: {own.title}')
        raise KhrError('bout: no bout given; accepted: one of these, or a bout file')
    refuse_offline(offline, one_process, domain, network)
    check_domain(domain)  # before a folder is made
    settings = [*(set_ or []), *([f'simulator.engine={engine}'] if engine else [])]
    chosen = load_bout(bout)
    chosen = chosen.set_to(settings) if settings else chosen
    if print_ros2:
        arguments = {'record': '' if record else 'false', 'out': str(out or '')}
        print(ros2_command(bout, settings, {}, arguments))
        return
    bar = ProgressBar(
        total=chosen.rules.rounds * chosen.rules.time_limit, unit='s', console=console
    )
    way = RunOptions(offline, one_process is not False, record, domain, network)
    with claim_folder(out, chosen.name) as folder, bar:

        def started(entry: RunEntry) -> None:
            print_line(console, f'{chosen.name}: {entry.to_join}  folder {folder}')
            if entry.network:
                print_line(console, f'khr: {NETWORK}')

        if offline:
            print_line(console, f'{chosen.name}: folder {folder}')
        callbacks = Callbacks(started=started, progress=partial(show_run, bar))
        result = run_to_decision(chosen, folder, way, callbacks)
    for warning in result.warnings:
        print_line(console, f'khr: {warning}')
    _summarise(result)
    print(f'folder {folder}')


def _summarise(result: BoutResult) -> None:
    """Print rounds and winner of a bout."""
    print(result.bout.title or result.bout.name)
    table = Table('round', 'won by', 'reason', 'time, s', *result.bout.robots, show_edge=False)
    for number, each in enumerate(result.rounds, 1):
        outcomes = [
            outcome.verdict + (f' at {outcome.fell_at:.2f} s' if outcome.fell_at else '')
            for outcome in each.outcomes.values()
        ]
        decision = each.decision
        table.add_row(
            str(number), decision.winner, decision.reason, f'{decision.time:.2f}', *outcomes
        )
    Console().print(table)
    won = ' : '.join(str(result.won[robot]) for robot in result.bout.robots)
    print(DRAW if result.winner == DRAW else f'winner {result.winner}', f'({won})')
    print(f'real-time factor {result.real_time_factor:.2f}')
    for number, each in enumerate(result.rounds, 1):
        print(f'round {number} trajectory hash {each.trajectory_hash}')
