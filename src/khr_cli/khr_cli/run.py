"""``khr run``: one scenario, over topics or offline, with progress and a summary."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn
from rich.table import Table

from khr_analysis.outcome_text import LABELS, shown
from khr_bringup.bags import bag_of
from khr_bringup.code_version import as_run
from khr_bringup.expectation import Expectation, realtime_text
from khr_bringup.following import write_outcome
from khr_bringup.offline import duration, run_offline
from khr_bringup.processes import Processes
from khr_bringup.run_registry import check_domain, registered
from khr_bringup.scenario import Scenario
from khr_common import KhrError
from khr_common.files import write_text
from khr_sim.run_parameters import RunParameters

INTERRUPTED = 130  # the shell's exit code for SIGINT
REFRESH = 0.2  # s of wall time
NETWORK = (
    '--network: every machine that reaches this one may see all topics, publish on them and '
    'change parameters; UDP ports are open on all interfaces'
)


@dataclass(frozen=True)
class Viewing:
    """How a run is shown in a browser; see ``khr view --help``.

    Attributes:
        host, port: that the page is served on.
        browser: whether to open it.
        stay: whether the run stays until it is interrupted, and may be started anew.
    """

    host: str = '127.0.0.1'
    port: int = 0
    browser: bool = True
    stay: bool = False


@dataclass(frozen=True)
class Options:
    """How to run a scenario; see ``khr run --help``."""

    offline: bool = False
    one_process: bool = False
    record: bool = True
    draw: bool = True
    out: Path | None = None
    expect: str = ''
    domain: int | None = None
    network: bool = False
    view: Viewing | None = None

    @property
    def stay(self) -> bool:
        """Return whether the run goes on until it is interrupted."""
        return self.view is not None and self.view.stay


@dataclass(frozen=True)
class Result:
    """The result of a run, over topics or offline."""

    verdict: str
    quantities: dict[str, str]
    trajectory_hash: str
    end: str
    startup: float  # s of wall time to the first control period
    wall_time: float  # s of wall time from there to the last
    failure: str = ''  # what went wrong after the run itself
    scenario: Scenario | None = None  # that the graph was switched to
    realtime: Mapping[str, str] = field(default_factory=dict)  # how it kept to the wall clock

    @property
    def real_time_factor(self) -> float:
        """Return simulated by wall time; the simulator's own if it followed the wall clock."""
        whole = float(self.quantities.get('time_s', 0.0)) / max(self.wall_time, 1e-9)
        return float(self.realtime.get('real_time_factor', whole))


def run_scenario(scenario: Scenario, options: Options) -> int:
    """Run a scenario, print its summary, keep its results; return the exit code.

    Raises:
        KhrError: if an option is not accepted.
        RunError: if the run could not go on.
    """
    expected = Expectation.parse(options.expect, '--expect', scenario, options.offline)
    console = Console(stderr=True)
    scenario = _bounded(scenario, options)
    check_domain(options.domain)  # refused before a folder is made, and so is the page
    page = _page(options.view, console)
    folder = _folder(scenario, options.out)
    start = time.monotonic()
    if options.offline:
        write_text(folder / 'scenario.yaml', as_run(scenario))
    result = (
        _offline(scenario, console, start)
        if options.offline
        else _graph(scenario, folder, options, page, console, start)
    )
    scenario = result.scenario or scenario
    failures = [result.failure] if result.failure else []
    try:
        _keep(folder, scenario, result)
        if options.record and options.draw and not options.offline:
            _draw(folder, scenario, console)
    except KhrError as error:  # what was measured is printed all the same
        failures.append(str(error))
    except KeyboardInterrupt:
        failures.append('interrupted while the results were written; the folder may lack some')
    _summarise(scenario, folder, result, options)
    for failure in failures:
        _say(console, f'khr: {failure}')
    if failures:
        return 1
    if result.end == 'stopped':
        return 0 if options.stay else INTERRUPTED
    unmet = expected.unmet(result.verdict, result.realtime)
    if unmet:
        _say(console, f'khr: {unmet}')
    return 1 if unmet else 0


def _bounded(scenario: Scenario, options: Options) -> Scenario:
    """Return the scenario with its duration, the motion's by default."""
    if options.stay:
        return scenario
    return scenario.changed({('simulator', 'duration'): duration(scenario)})


def _folder(scenario: Scenario, out: Path | None) -> Path:
    folder = out or Path('runs') / f'{scenario.name}-{datetime.now():%Y%m%d-%H%M%S-%f}'[:-3]
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise KhrError(f'--out: {str(folder)!r} holds something; accepted: a new or empty folder')
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise KhrError(
            f'--out: {str(folder)!r}: {error.strerror}; accepted: a folder that can be written'
        ) from error
    return folder


def _graph(
    scenario: Scenario,
    folder: Path,
    options: Options,
    page: Callable[[Processes], None],
    console: Console,
    start: float,
) -> Result:
    from khr_bringup.graph import prepare, run_graph

    seconds = scenario.table(RunParameters).duration
    with registered(scenario.name, folder, options.domain, options.network) as entry:
        _say(console, f'{scenario.name}: {entry.to_join}  folder {folder}')
        if entry.network:
            _say(console, f'khr: {NETWORK}')
        with _progress(console, seconds) as show:

            def show_view(view: Any) -> None:
                values = view.progress
                waiting = (
                    ', '.join(view.behind)
                    if view.state == 'finished'
                    else view.state_values.get('waiting_for')
                )
                show(
                    float(values.get('time', 0.0)),
                    f'waiting for {waiting}' if waiting else view.state,
                    values.get('real_time_factor'),
                    values.get('pitch_rate'),
                    values.get('peak'),
                )

            result = run_graph(
                prepare(scenario, folder, options.record),
                folder,
                entry,
                record=options.record,
                one_process=options.one_process,
                show=show_view,
                beside=page,
                stay=options.stay,
            )
    for warning in result.warnings:
        _say(console, f'khr: {warning}')
    return Result(
        result.verdict,
        result.outcome,
        result.trajectory_hash,
        result.end,
        result.started - start,
        result.ended - result.started,
        result.failure,
        result.scenario,
        result.realtime,
    )


def play(paths: Sequence[Path], viewing: Viewing) -> int:
    """Play recorded runs back in a browser until interrupted; return the exit code."""
    from khr_view import playback
    from khr_view.beside import announced
    from khr_view.guard import open_door

    say = partial(_say, Console(stderr=True))
    return playback.play(
        paths, lambda: announced(open_door(viewing.host, viewing.port), viewing.browser, say)
    )


def _page(viewing: Viewing | None, console: Console) -> Callable[[Processes], None]:
    """Open the door of the page, if there is to be one; return what names and starts it."""
    if viewing is None:
        return lambda _: None
    from khr_view.beside import announced, start
    from khr_view.guard import open_door

    door, say = open_door(viewing.host, viewing.port), partial(_say, console)
    return lambda processes: start(announced(door, viewing.browser, say), processes)


def _offline(scenario: Scenario, console: Console, start: float) -> Result:
    from khr_analysis.outcome_text import quantities

    began = start
    with _progress(console, scenario.table(RunParameters).duration) as show:

        def watch(truth: Any, loop: Any, _: object) -> None:
            nonlocal began
            seconds = truth.stamp_ns / 1e9
            if truth.step == 0:
                began = time.monotonic()
            show(
                seconds,
                'offline',
                f'{seconds / (time.monotonic() - began + 1e-9):.2f}',
                f'{loop.pitch_rate:.3f}',
                None,
            )

        result = run_offline(scenario, watch)
    return Result(
        result.outcome.verdict,
        quantities(result.outcome),
        result.trajectory_hash,
        result.end,
        began - start,
        time.monotonic() - began,
    )


@contextmanager
def _progress(console: Console, seconds: float) -> Iterator[Callable[..., None]]:
    columns = (TextColumn('{task.description}'), BarColumn(), TextColumn('{task.fields[text]}'))
    with Progress(*columns, console=console, transient=True, auto_refresh=False) as progress:
        task = progress.add_task('starting', total=seconds, text='')
        shown = 0.0

        def show(
            simulated: float, state: str, factor: str | None, rate: str | None, peak: str | None
        ) -> None:
            nonlocal shown
            if time.monotonic() - shown < REFRESH:
                return
            shown = time.monotonic()
            words = [f'{simulated:6.2f} of {seconds:.2f} s']
            words += [f'x{factor}'] if factor else []
            words += [f'pitch rate {rate} rad/s'] if rate else []
            words += [f'peak {peak}'] if peak else []
            progress.update(task, completed=simulated, description=state, text='  '.join(words))
            progress.refresh()

        yield show


def _keep(folder: Path, scenario: Scenario, result: Result) -> None:
    write_outcome(
        folder,
        scenario.name,
        result.verdict,
        {**result.quantities, **result.realtime},
        end=result.end,
        startup_s=round(result.startup, 3),
        real_time_factor=round(result.real_time_factor, 3),
        trajectory_hash=result.trajectory_hash,
    )


def _draw(folder: Path, scenario: Scenario, console: Console) -> None:
    from khr_figures.run_overview import draw_run

    try:
        draw_run(folder, scenario, folder / 'overview.png')
    except KhrError as error:  # the run itself is done and kept
        _say(console, f'khr: no overview: {error}')


def _summarise(scenario: Scenario, folder: Path, result: Result, options: Options) -> None:
    table = Table(show_header=False)
    table.add_row('outcome', f'[bold]{result.verdict or "unknown"}[/bold]')
    for name, label in LABELS.items():
        if value := result.quantities.get(name):
            table.add_row(label, escape(shown(name, value)))
    table.add_row('ended by', result.end)
    table.add_row('real-time factor', f'{result.real_time_factor:.2f}')
    if result.realtime:
        table.add_row('real time', realtime_text(result.realtime))
    table.add_row('wall time', f'{result.startup:.1f} s to start, {result.wall_time:.1f} s to run')
    console = Console()
    _say(console, scenario.title or scenario.name)
    console.print(table)
    _say(console, f'folder {folder}')
    if options.record and not options.offline:
        _say(console, f'bag {bag_of(folder)}')
    _say(console, f'trajectory hash {result.trajectory_hash}')


def _say(console: Console, text: str) -> None:
    """Print one line as it is: whole at whatever width, so that its paths can be copied."""
    console.print(text, highlight=False, markup=False, soft_wrap=True)
