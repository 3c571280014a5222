"""Verbs of bouts."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from khr.cli.run import NETWORK, numbered, print_line
from khr.cli.verbs.options import (
    BoutSetOption,
    DomainOption,
    NetworkOption,
    OfflineOption,
    OutOption,
    OwnEngineOption,
    PrintRos2Option,
    ProcessesChoice,
    RecordOption,
    ViewOption,
    refuse_offline,
    refuse_with_ros2,
    ros2_command,
)
from khr_analysis.referee import DRAW
from khr_bringup.bout.bout import Bout, load_bout, shipped_bouts
from khr_bringup.bout.result import BoutResult
from khr_bringup.graph.following import Callbacks
from khr_bringup.graph.graph import RunOptions
from khr_bringup.graph.run_registry import RunEntry, check_domain
from khr_bringup.run_folder import claim_folder
from khr_bringup.running import run_to_decision
from khr_common.errors import INTERRUPTED, KhrError
from khr_sim.run_parameters import RunParameters
from khr_sweeps.progress import ProgressBar, show_run
from khr_view.viewing import Viewing, live_page


def start_bout(
    bout: Annotated[
        str | None, typer.Argument(help='A bout file or name; without one, they are listed.')
    ] = None,
    offline: OfflineOption = False,
    one_process: ProcessesChoice = None,
    engine: OwnEngineOption = None,
    set_: BoutSetOption = None,
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
    chosen = load_bout(bout).set_to(settings)
    if print_ros2:
        refuse_with_ros2(offline, one_process, domain, network, view)
        arguments = {'record': '' if record else 'false', 'out': str(out or '')}
        print(ros2_command(bout, settings, arguments))
        return
    way = RunOptions(offline, one_process is not False, record, domain, network)
    run_bout(chosen, way, out, Viewing() if view else None)


def run_bout(
    bout: Bout, way: RunOptions, out: Path | None, viewing: Viewing | None = None
) -> None:
    """Run a bout, print its summary, keep its results.

    Args:
        bout: to run.
        way: how to run it.
        out: folder of the bout; a new one by default.
        viewing: how its page is shown, if it is.
    """
    check_domain(way.domain)  # before a folder is made or the page is opened
    console = Console(stderr=True)
    with live_page(viewing, partial(print_line, console), robots=[*bout.robots]) as observed:
        try:
            _run(bout, way, out, Callbacks(observed=observed), console)
        except KeyboardInterrupt:
            print_line(console, 'khr: interrupted before the bout had ended; its folder stays')
            raise typer.Exit(INTERRUPTED) from None


def view_bout(bout: Bout, way: RunOptions, out: Path | None, viewing: Viewing) -> int:
    """Run a bout on a page, again and again while a browser is connected, until Ctrl-C."""
    check_domain(way.domain)
    console = Console(stderr=True)
    with live_page(viewing, partial(print_line, console), robots=[*bout.robots]) as observed:
        for number in count(1):
            own = out if number == 1 else numbered(out, number)
            try:
                _run(bout, way, own, Callbacks(observed=observed), console)
                if viewing.again == 'never':
                    return 0
                observed.wait_for_reader()
            except KeyboardInterrupt:
                return 0
            if viewing.again == 'next':
                seed = next(iter(bout.robots.values())).table(RunParameters).seed + 1
                bout = replace(bout.set_to([f'simulator.seed={seed}']), title=bout.title)
    return 0


def _run(
    bout: Bout, way: RunOptions, out: Path | None, callbacks: Callbacks, console: Console
) -> None:
    bar = ProgressBar(total=bout.rules.rounds * bout.rules.time_limit, unit='s', console=console)
    with claim_folder(out, bout.name) as folder, bar:

        def started(entry: RunEntry) -> None:
            print_line(console, f'{bout.name}: {entry.to_join}  folder {folder}')
            if entry.network:
                print_line(console, f'khr: {NETWORK}')

        if way.offline:
            print_line(console, f'{bout.name}: folder {folder}')
        hooks = replace(callbacks, started=started, progress=partial(show_run, bar))
        result = run_to_decision(bout, folder, way, hooks)
    for warning in result.warnings:
        print_line(console, f'khr: {warning}')
    _summarise(result)
    print(f'folder {folder}', flush=True)


def _summarise(result: BoutResult) -> None:
    """Print rounds and winner of a bout."""
    print(result.bout.title or result.bout.name)
    table = Table('round', 'winner', 'reason', 'time, s', *result.bout.robots, show_edge=False)
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
