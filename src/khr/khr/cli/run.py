"""``khr run``: one scenario, over topics or offline, with progress and a summary."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from rich.console import Console

from khr.cli.progress import show_run
from khr.cli.summary import print_line, summarise
from khr_bringup.graph.graph import Callbacks, RunOptions
from khr_bringup.graph.run_registry import RunEntry, check_domain
from khr_bringup.offline import duration
from khr_bringup.result import Result, write_outcome
from khr_bringup.run_folder import claimed
from khr_bringup.running import run_to_end
from khr_bringup.scenario.expectation import Expectation
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.errors import INTERRUPTED
from khr_sim.run_parameters import RunParameters
from khr_sweeps.progress import ProgressBar
from khr_view.beside import Viewing, page

NETWORK = (
    '--network: every machine that reaches this one may see all topics, publish on them and '
    'change parameters; UDP ports are open on all interfaces'
)


@dataclass(frozen=True)
class Options:
    """How to run a scenario, and what to make of it; see ``khr run --help``."""

    way: RunOptions = field(default_factory=RunOptions)
    draw: bool = True
    out: Path | None = None
    expect: str = ''
    view: Viewing | None = None

    @property
    def recorded(self) -> bool:
        """Return whether the run leaves a bag."""
        return self.way.record and not self.way.offline


def run_scenario(scenario: Scenario, options: Options) -> int:
    """Run a scenario, print its summary, keep its results; return the exit code.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if the run could not go on.
    """
    way = options.way
    expected = Expectation.parse(options.expect, '--expect', scenario, way.offline)
    console = Console(stderr=True)
    report = partial(print_line, console)
    check_domain(way.domain)  # refused before a folder is made, and so is the page
    beside = page(options.view, report)
    lasts = scenario.table(RunParameters).duration if way.stay else duration(scenario)
    bar = ProgressBar(total=lasts, unit='s', console=console)

    with claimed(options.out, scenario.name) as folder, bar:

        def begun(entry: RunEntry) -> None:
            report(f'{scenario.name}: {entry.to_join}  folder {folder}')
            if entry.network:
                report(f'khr: {NETWORK}')
            bar.show('starting', 0.0)

        result = run_to_end(
            scenario, folder, way, Callbacks(begun, partial(show_run, bar), beside)
        )
    for warning in result.warnings:
        report(f'khr: {warning}')
    failures = _kept(folder, result, options, console)
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
    """Keep what a run came to, and draw what it recorded; return what failed of the run and this.

    What was measured is printed all the same.
    """
    failures = [result.failure] if result.failure else []
    try:
        write_outcome(folder, result)
        if options.recorded and options.draw:
            _draw(folder, result.scenario, console)
    except KhrError as error:
        failures.append(str(error))
    except KeyboardInterrupt:
        failures.append('interrupted while the results were written; the folder may lack some')
    return failures


def _draw(folder: Path, scenario: Scenario, console: Console) -> None:
    from khr_report.run.overview import draw_run

    try:
        draw_run(folder, scenario, folder / 'overview.png')
    except KhrError as error:  # the run itself is done and kept
        print_line(console, f'khr: no overview: {error}')
