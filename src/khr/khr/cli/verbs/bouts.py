"""Verbs of bouts."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from khr.cli.summary import print_line
from khr.cli.verbs.options import OutOption, OwnEngineOption, RecordOption, SetOption
from khr_analysis.referee import DRAW
from khr_bringup.bout.bout import load_bout, shipped_bouts
from khr_bringup.bout.fight import BoutResult
from khr_bringup.bout.recorded import record_bout
from khr_bringup.run_folder import claim_folder
from khr_common.errors import KhrError
from khr_sweeps.progress import ProgressBar


def start_bout(
    bout: Annotated[
        str | None, typer.Argument(help='A bout file or name; without one, they are listed.')
    ] = None,
    engine: OwnEngineOption = None,
    set_: SetOption = None,
    record: RecordOption = True,
    out: OutOption = None,
) -> None:
    """Let two robots fight: both in one world, without a graph, with bags and hashes."""
    console = Console(stderr=True)
    if bout is None:
        for path in shipped_bouts():
            own = load_bout(str(path))
            print_line(Console(), f'{own.name}: {own.title}')
        raise KhrError('bout: no bout given; accepted: one of these, or a bout file')
    settings = [*(set_ or []), *([f'simulator.engine={engine}'] if engine else [])]
    chosen = load_bout(bout)
    chosen = chosen.set_to(settings) if settings else chosen
    bar = ProgressBar(
        total=chosen.rules.rounds * chosen.rules.time_limit, unit='s', console=console
    )
    with claim_folder(out, chosen.name) as folder, bar:
        print_line(console, f'{chosen.name}: folder {folder}')
        result = record_bout(chosen, folder, record, lambda time: bar.show('fighting', time))
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
