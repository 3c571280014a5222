"""``khr run``: one scenario, over topics or offline, with progress and a summary."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from khr_analysis.outcome_values import labelled
from khr_bringup.graph.following import Callbacks
from khr_bringup.graph.graph import RunOptions
from khr_bringup.graph.run_registry import RunEntry, check_domain, registered
from khr_bringup.offline import duration
from khr_bringup.recorded.bags import bag_of
from khr_bringup.result import NO_HASH, Result, write_outcome
from khr_bringup.run_folder import claim_folder
from khr_bringup.running import run_to_end
from khr_bringup.scenario.expectation import Expectation, realtime_text
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.errors import INTERRUPTED, quoted
from khr_sim.run_parameters import RunParameters
from khr_sweeps.progress import ProgressBar, show_run
from khr_view.session import Session
from khr_view.viewing import Viewing, live_page

NETWORK = (
    '--network: every machine that reaches this one may see all topics, publish on them and '
    'change parameters; UDP ports are open on all interfaces'
)


@dataclass(frozen=True)
class Options:
    """Options of a run and of its results; see ``khr run --help``."""

    run: RunOptions = field(default_factory=RunOptions)
    draw: bool = True
    out: Path | None = None
    expect: str = ''
    view: Viewing | None = None

    @property
    def recorded(self) -> bool:
        """Return whether the run has a bag."""
        return self.run.record and not self.run.offline


def run_scenario(scenario: Scenario, options: Options) -> int:
    """Run a scenario, print its summary, keep its results; return the exit code.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if the run could not go on.
    """
    expected = Expectation.parse(options.expect, '--expect', scenario, options.run.offline)
    console = Console(stderr=True)
    check_domain(options.run.domain)  # before a folder is made or the page is opened
    with live_page(options.view, partial(print_line, console)) as observed:
        return _run(scenario, options, expected, console, Callbacks(observed=observed))


def view_scenario(scenario: Scenario, options: Options) -> int:
    """Run a scenario, then each scenario requested on its page; return the exit code.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if a run could not go on.
    """
    console, session = Console(stderr=True), Session(scenario)
    domain = registered(scenario.name, Path(), options.run.domain)
    report = partial(print_line, console)
    with live_page(options.view, report, session) as observed, domain as entry:
        callbacks = Callbacks(
            observed=observed,
            finish=lambda: session.next is not None,
            interrupted=session.end,
            switch=session.switch,
        )
        for number in count(1):
            out = options.out if number == 1 else numbered(options.out, number)
            attempt = replace(options, out=out)
            code = _run(
                session.scenario, attempt, Expectation(), console, callbacks, entry, session
            )
            if code or not session.advance():
                return code
    return 0


def numbered(out: Path | None, number: int) -> Path | None:
    """Return the folder of another run beside the first."""
    return out and out.with_name(f'{out.name}-{number}')


def _run(
    scenario: Scenario,
    options: Options,
    expected: Expectation,
    console: Console,
    callbacks: Callbacks,
    entry: RunEntry | None = None,
    session: Session | None = None,
) -> int:
    """Run a scenario in a folder of its own; return the exit code."""
    way, report = options.run, partial(print_line, console)
    lasts = scenario.table(RunParameters).duration if way.stay else duration(scenario)
    bar = ProgressBar(total=lasts, unit='s', console=console)

    with claim_folder(options.out, scenario.name) as folder, bar:

        def started(entry: RunEntry) -> None:
            report(f'{scenario.name}: {entry.to_join}  folder {folder}')
            if entry.network:
                report(f'khr: {NETWORK}')
            bar.show('starting', 0.0)

        hooks = replace(callbacks, started=started, progress=partial(show_run, bar))
        result = run_to_end(scenario, folder, way, hooks, entry)
    for warning in result.warnings:
        report(f'khr: {warning}')
    last = session is None or session.next is None  # a plot would delay the next run
    failures = _kept(folder, result, replace(options, draw=options.draw and last), console)
    summarise(result, folder, options.recorded)
    for failure in failures:
        report(f'khr: {failure}')
    if failures:
        return 1
    if result.end == 'stopped':
        return 0 if way.stay else INTERRUPTED
    unmet = expected.unmet(result.verdict, result.realtime)
    if unmet:
        report(f'khr: {unmet}')
    return 1 if unmet else 0


def _kept(folder: Path, result: Result, options: Options, console: Console) -> list[str]:
    """Write the outcome of a run and draw its recording; return all errors.

    The summary is printed in any case.
    """
    failures = [result.failure] if result.failure else []
    try:
        write_outcome(folder, result)
        began = result.time > 0.0 or result.end != 'stopped'
        if options.recorded and options.draw and began:
            _draw(folder, console)
    except KhrError as error:
        failures.append(str(error))
    except KeyboardInterrupt:
        failures.append('interrupted while the results were written; the folder may lack some')
    return failures


def _draw(folder: Path, console: Console) -> None:
    from khr_report.run.overview import draw_run

    try:
        draw_run(folder, folder / 'overview.png')
    except KhrError as error:  # the run itself is done and kept
        print_line(console, f'khr: no overview: {error}')


MOST_CHANGES = 5  # that are named


def summarise(result: Result, folder: Path, recorded: bool) -> None:
    """Print outcome, timing and folder of a run; its trajectory hash is the last line."""
    table = Table(show_header=False)
    table.add_row('outcome', f'[bold]{result.verdict or "no verdict"}[/bold]')
    for label, text in labelled(result.judged).items():
        table.add_row(label, escape(text))
    table.add_row('ended by', escape(result.end))
    table.add_row('real-time factor', f'{result.real_time_factor:.2f}')
    if result.realtime:
        table.add_row('real time', escape(realtime_text(result.realtime)))
    table.add_row('wall time', f'{result.startup:.1f} s to start, {result.wall_time:.1f} s to run')
    console = Console()
    print_line(console, result.scenario.title or result.scenario.name)
    console.print(table)
    for each in result.changes[:MOST_CHANGES]:
        name = f'{each.node}.{each.parameter}'
        print_line(
            console, f'changed while it ran: {name} to {quoted(each.value)} at {each.time:.3f} s'
        )
    if len(result.changes) > MOST_CHANGES:
        more = len(result.changes) - MOST_CHANGES
        print_line(console, f'and {more} more change{"s" * (more > 1)}')
    print_line(console, f'folder {folder}')
    if recorded:
        print_line(console, f'bag {bag_of(folder)}')
    print_line(console, f'trajectory hash {result.trajectory_hash or NO_HASH}')


def print_line(console: Console, text: str) -> None:
    """Print a line without wrapping, so that its paths can be copied."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
