"""The ``khr`` command: its verbs, each a few lines over the module that does the work."""

from __future__ import annotations

import signal
import sys
from importlib import metadata
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from typer.exceptions import TyperException

from khr_bringup import scenario as scenarios
from khr_common import KhrError, RunError

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)


def _scenario_names(incomplete: str) -> list[str]:
    """Complete the name of a scenario that comes with the project."""
    return [path.stem for path in scenarios.shipped() if path.stem.startswith(incomplete)]


def _show_version(asked: bool) -> None:
    if asked:
        print(f'khr {metadata.version("khr_cli")}')
        raise typer.Exit


ScenarioArgument = typer.Argument(
    help='A scenario file or name; without one, they are listed.', autocompletion=_scenario_names
)
DomainOption = Annotated[
    int | None, typer.Option('--domain', help='ROS domain of the run (1 to 99).')
]


@app.callback()
def top(
    version: Annotated[
        bool,
        typer.Option('--version', help='Show the version.', callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Balance control of the KHR-3HV humanoid as a ROS 2 node graph."""


@app.command()
def run(
    scenario: Annotated[str | None, ScenarioArgument] = None,
    duration: Annotated[
        float | None, typer.Option(help='Simulated seconds; the length of the motion by default.')
    ] = None,
    realtime: Annotated[
        bool, typer.Option('--realtime', help='Run against the wall clock instead of in lockstep.')
    ] = False,
    offline: Annotated[
        bool,
        typer.Option(
            '--offline', help='The same cores without ROS: no topics, no bag, the same trajectory.'
        ),
    ] = False,
    one_process: Annotated[
        bool,
        typer.Option(
            '--one-process/--processes', help='All nodes in one process, or one process each.'
        ),
    ] = True,
    record: Annotated[bool, typer.Option('--record/--no-record', help='Write a bag.')] = True,
    out: Annotated[
        Path | None, typer.Option(help="The run's folder; runs/SCENARIO-TIME by default.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option('--set', help='Change a parameter of the scenario: node.parameter=value.'),
    ] = None,
    expect: Annotated[
        str | None,
        typer.Option(
            help='Exit with 1 unless the outcome is this: walked, stood, fell or slipped.'
        ),
    ] = None,
    domain: DomainOption = None,
    network: Annotated[
        bool, typer.Option('--network', help='Let other machines join; by default none can.')
    ] = False,
    view: Annotated[
        bool, typer.Option('--view', help='Show it in a browser while it runs.')
    ] = False,
) -> None:
    """Run a scenario and keep its recording, outcome and trajectory hash."""
    from khr_cli import run as runs

    if scenario is None:
        list_scenarios()
        raise KhrError('run: no scenario given; accepted: one of these, or a scenario file')
    changes = scenarios.changes_of(set_ or [])
    if duration is not None:
        changes['simulator', 'duration'] = duration
    if realtime:
        changes['simulator', 'sync'] = 'realtime'
    chosen = scenarios.load(scenario).changed(changes)
    options = runs.Options(
        offline=offline,
        one_process=one_process,
        record=record,
        out=out,
        expect=expect,
        domain=domain,
        network=network,
        view=runs.Viewing() if view else None,
    )
    raise typer.Exit(runs.run(chosen, options))


@app.command(name='view')
def view(
    what: Annotated[str, typer.Argument(help='A scenario file or name, or the folder of a run.')],
    against: Annotated[
        Path | None, typer.Option(help='Another run to play back beside it.')
    ] = None,
    pace: Annotated[
        float, typer.Option(help='Simulated by wall time; 0 goes as fast as it can.')
    ] = 1.0,
    duration: Annotated[
        float, typer.Option(help='Simulated seconds; 0 goes on until stopped.')
    ] = 0.0,
    host: Annotated[
        str, typer.Option(help='Address of the page; one that others reach needs a token.')
    ] = '127.0.0.1',
    port: Annotated[
        int, typer.Option(help='Port of the page; the first free one from 8090 on by default.')
    ] = 0,
    browser: Annotated[
        bool, typer.Option('--browser/--no-browser', help='Open the page in a browser.')
    ] = True,
    record: Annotated[bool, typer.Option('--record/--no-record', help='Write a bag.')] = True,
    out: Annotated[
        Path | None, typer.Option(help="The run's folder; runs/SCENARIO-TIME by default.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option('--set', help='Change a parameter of the scenario: node.parameter=value.'),
    ] = None,
    domain: DomainOption = None,
) -> None:
    """Show a scenario that runs, or a run that was recorded, in a browser, until Ctrl-C."""
    from khr_cli import run as runs

    if against is not None or Path(what).is_dir() or what.endswith('.mcap'):
        both = [Path(what), *([against] if against else [])]
        raise typer.Exit(runs.play(both, runs.Viewing(host, port, browser)))
    changes = scenarios.changes_of(set_ or [])
    changes |= {('simulator', 'pace'): pace, ('simulator', 'duration'): duration}
    viewing = runs.Viewing(host, port, browser, stay=True)
    options = runs.Options(one_process=True, record=record, out=out, domain=domain, view=viewing)
    raise typer.Exit(runs.run(scenarios.load(what).changed(changes), options))


@app.command(name='scenarios')
def list_scenarios() -> None:
    """List the scenarios that come with the project."""
    from khr_bringup.scenario_table import scenario_table

    Console().print(scenario_table(map(scenarios.load, map(str, scenarios.shipped()))))


@app.command(name='get')
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


@app.command(name='set')
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


@app.command(name='switch')
def switch_scenario(
    scenario: Annotated[str, typer.Argument(help='A scenario file or name.')],
    domain: DomainOption = None,
) -> None:
    """Start a running graph anew with another scenario, taken as a whole or not at all."""
    from khr_bringup.live import switch_scenario as switch

    path = scenarios.find(scenario)
    scenarios.load(str(path))
    print(f'{path.stem}: {switch(path, domain)}')


@app.command()
def doctor() -> None:
    """Check what a run needs and advise on what is missing."""
    from khr_cli.doctor import examine

    raise typer.Exit(examine(Console()))


@app.command()
def figure(
    numbers: Annotated[
        list[str], typer.Argument(help='Figures of the thesis, such as 3.8 5.9, or all.')
    ],
    out: Annotated[Path, typer.Option(help='Folder for PNG and CSV.')] = Path('figures'),
    fast: Annotated[
        bool, typer.Option('--fast', help='Use the quick, coarse form of its experiments.')
    ] = False,
) -> None:
    """Draw figures of the thesis from its models, or from experiments, which are run first."""
    from khr_report.reproduce import figures

    for path in figures(numbers, out, fast):
        print(path)


@app.command()
def reproduce(
    only: Annotated[
        str | None,
        typer.Option(help='Figures, maps and "scoreboard", separated by commas; all by default.'),
    ] = None,
    fast: Annotated[
        bool, typer.Option('--fast', help='Use the quick, coarse form: minutes.')
    ] = False,
    out: Annotated[Path, typer.Option(help='Folder of the page.')] = Path('report'),
    workers: Annotated[
        int | None, typer.Option(help='Processes; one per core by default.')
    ] = None,
    findings: Annotated[
        Path | None,
        typer.Option(help='The findings as Markdown; findings.md in the folder by default.'),
    ] = None,
) -> None:
    """Run every experiment of the thesis anew, draw every figure, and write one page."""
    from khr_report.reproduce import reproduce as run_all

    raise typer.Exit(run_all(out, only, fast, workers, findings))


@app.command()
def lines(
    scenario: Annotated[
        str, typer.Argument(help='A walking scenario: file or name.')
    ] = 'walk_6.99deg_ka12',
    fast: Annotated[bool, typer.Option('--fast', help='One seed: no intervals.')] = False,
    out: Annotated[Path | None, typer.Option(help='The Markdown file to write as well.')] = None,
    workers: Annotated[
        int | None, typer.Option(help='Processes; one per core by default.')
    ] = None,
) -> None:
    """Attribute a walk's spectral peaks to gait, feedback or slip."""
    from khr_report.peak_origin_page import peak_origin

    print(peak_origin(scenario, fast, workers, out))


@app.command()
def push(
    ka: Annotated[
        str, typer.Option(help='Ankle gains K_A, separated by commas; 0 is no control.')
    ] = '0,12,18',
    duration: Annotated[
        str, typer.Option(help='Durations of the pushes in s, separated by commas.')
    ] = '0.1,0.2,0.5',
    direction: Annotated[
        str, typer.Option(help='Where the pushes come from, separated by commas: front, behind.')
    ] = 'front,behind',
    gyro: Annotated[
        str, typer.Option(help='Gyro models, separated by commas: packaged, circuit.')
    ] = 'packaged,circuit',
    out: Annotated[
        Path | None,
        typer.Option(help='Folder for push.csv and push.md; only printed if left out.'),
    ] = None,
) -> None:
    """Find the largest push the standing robot survives, beside the model's."""
    from khr_experiments import push_limits
    from khr_report import push_page
    from khr_report.page.document import markdown

    if out:
        push_page.make_folder(out)
    rows = push_limits.measure_all(
        push_limits.conditions(
            push_limits.numbers('--ka', ka),
            push_limits.numbers('--duration', duration),
            direction.split(','),
            gyro.split(','),
        )
    )
    print(markdown([push_page.largest_pushes(rows)]))
    for path in push_page.write(rows, out) if out else []:
        print(path)


@app.command()
def critical(
    walk: Annotated[
        bool,
        typer.Option('--walk/--stand', help='Walk, or lift one leg on the force-sensor pads.'),
    ] = True,
    ka: Annotated[float, typer.Option(help='Ankle gain K_A; 0 is no control.')] = 0.0,
    kh: Annotated[float, typer.Option(help='Hip gain K_H; 0 is no control.')] = 0.0,
    surface: Annotated[
        str, typer.Option(help='Surface of a walk: smooth, rubber or pads.')
    ] = 'smooth',
    uphill: Annotated[
        bool, typer.Option('--uphill', help='Face uphill: where does it fall backward?')
    ] = False,
    seeds: Annotated[int, typer.Option(help='Number of seeds.')] = 5,
    tolerance: Annotated[float, typer.Option(help='Tolerance of each bisection, in deg.')] = 0.1,
    jobs: Annotated[int, typer.Option(help='Processes.')] = 2,
    set_: Annotated[
        list[str] | None, typer.Option('--set', help='Change a parameter: node.parameter=value.')
    ] = None,
) -> None:
    """Measure the critical inclination, in deg, by bisection over seeds."""
    from khr_experiments.critical import Condition, report

    changes = tuple(scenarios.changes_of(set_ or []).items())
    print(
        report(
            Condition('walk' if walk else 'leg_lift', ka, kh, surface, changes, uphill),
            seeds,
            tolerance,
            jobs,
        )
    )


@app.command()
def calibrate(
    config: Annotated[
        Path | None,
        typer.Option(help='Free constants and rows; the shipped calibration.yaml if left out.'),
    ] = None,
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/calibration.md'),
    members: Annotated[
        Path, typer.Option(help='The file of the robots that fit to write.')
    ] = Path('config/ensemble.json'),
    journal: Annotated[
        Path, typer.Option(help='A line per candidate; the same command goes on with it.')
    ] = Path('runs/calibration.jsonl'),
    engine: Annotated[str, typer.Option(help='Physics engine: bullet or mujoco.')] = 'mujoco',
    candidates: Annotated[int, typer.Option(help='Candidates to measure.')] = 400,
    population: Annotated[int, typer.Option(help='Candidates of a generation.')] = 10,
    seed: Annotated[int, typer.Option(help='Of the optimiser.')] = 0,
    seeds: Annotated[int, typer.Option(help='Seeds of each measurement.')] = 2,
    start: Annotated[
        Path | None,
        typer.Option(help='Begin at the best candidate of this journal, not at the defaults.'),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help='Processes on this machine; one per core by default.')
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help='Use the workers of a "dask scheduler", tcp://HOST:PORT.')
    ] = None,
) -> None:
    """Search the free constants so that all rows of the thesis come out at once."""
    from khr_report.calibration_page import Request
    from khr_report.calibration_page import calibrate as search

    print(
        search(
            Request(
                config,
                out,
                members,
                journal,
                engine,
                candidates,
                population,
                seed,
                seeds,
                start,
                workers,
                scheduler,
            )
        )
    )


@app.command()
def scoreboard(
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/scoreboard.md'),
    seeds: Annotated[int, typer.Option(help='Number of seeds of each measurement.')] = 3,
    tolerance: Annotated[float, typer.Option(help='Tolerance of each bisection, in deg.')] = 0.2,
    jobs: Annotated[int, typer.Option(help='Processes.')] = 2,
    explain: Annotated[
        bool, typer.Option('--explain/--no-explain', help='Search for what explains each miss.')
    ] = True,
) -> None:
    """Measure every row of the thesis on the simulated robot and write the scoreboard."""
    from khr_report.scoreboard_page import write

    print(f'{out}: {write(out, seeds, tolerance, jobs, explain)}')


@app.command()
def engines(
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/engines.md'),
    seeds: Annotated[int, typer.Option(help='Seeds of every limit.')] = 3,
    tolerance: Annotated[float, typer.Option(help='Of each bisection, in deg.')] = 0.1,
    jobs: Annotated[int, typer.Option(help='Processes.')] = 2,
    only: Annotated[
        str | None, typer.Option(help='Scenarios, with commas; all that are shipped if left out.')
    ] = None,
) -> None:
    """Run every scenario and limit on both physics engines, and say where they differ."""
    from khr_report.engines_page import write

    print(f'{out}: {write(out, seeds, tolerance, jobs, only)}')


@app.command()
def tune(
    scenario: Annotated[str, typer.Argument(help='A scenario file or name: motion and ground.')],
    set_: Annotated[
        list[str] | None,
        typer.Option('--set', help='Change a parameter first, such as the inclination.'),
    ] = None,
    gait: Annotated[
        bool, typer.Option('--gait', help='Search where the gait carries the centre of mass too.')
    ] = False,
    robust: Annotated[
        bool,
        typer.Option('--robust', help='For every robot of the ensemble that calibrate found.'),
    ] = False,
    seeds: Annotated[int, typer.Option(help='Runs of each candidate.')] = 3,
    candidates: Annotated[int, typer.Option(help='Candidates to try.')] = 64,
    seed: Annotated[int, typer.Option(help='Of the optimiser.')] = 0,
    jobs: Annotated[int, typer.Option(help='Processes.')] = 2,
    out: Annotated[
        Path | None, typer.Option(help='Folder of the results; runs/tune/NAME by default.')
    ] = None,
) -> None:
    """Find gains for a slope: most seeds up, then least slip, then least vibration."""
    from khr_report.tune_page import write

    print(write(scenario, set_ or [], gait, robust, seeds, candidates, seed, jobs, out))


@app.command()
def stage3(
    out: Annotated[
        Path, typer.Option(help='The page to write; data and picture beside it.')
    ] = Path('docs/stage3.md'),
    seeds: Annotated[int, typer.Option(help='Seeds of every point.')] = 2,
    engine: Annotated[str, typer.Option(help='Physics engine: bullet or mujoco.')] = 'mujoco',
    jobs: Annotated[int, typer.Option(help='Processes.')] = 2,
    measured: Annotated[
        bool,
        typer.Option('--measured', help='Write page and picture from the data, without runs.'),
    ] = False,
) -> None:
    """Explain the third stage of standing: what the hip's damping is worth, and where."""
    from khr_report import stage3_page

    print(stage3_page.again(out) if measured else stage3_page.write(out, seeds, engine, jobs))


@app.command()
def film(
    run: Annotated[str, typer.Argument(help='A run folder, or a scenario file or name.')],
    out: Annotated[
        Path | None,
        typer.Option(
            help='The file without suffix (with --still: the PNG); in the run folder if left out.'
        ),
    ] = None,
    still: Annotated[
        float | None, typer.Option(help='Only the picture at this time, in s.')
    ] = None,
    start: Annotated[float, typer.Option(help='Where the film starts, in s.')] = 0.0,
    end: Annotated[float | None, typer.Option(help='Where it ends, in s.')] = None,
    width: Annotated[int, typer.Option(help='Width of the pictures, in px.')] = 640,
    height: Annotated[int, typer.Option(help='Height of the pictures, in px.')] = 480,
    rate: Annotated[float, typer.Option(help='Pictures per simulated second.')] = 25.0,
) -> None:
    """Render a run to MP4 and GIF, or one picture of it to PNG."""
    from khr_report.film import render_run

    for path in render_run(run, out, still, (start, end), (width, height, rate)):
        print(path)


@app.command()
def sweep(
    specification: Annotated[Path, typer.Argument(help='A sweep file.')],
    out: Annotated[
        Path | None,
        typer.Option(
            help='Folder of the results, runs/NAME by default; runs already in it are kept.'
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help='Processes on this machine; one per core by default.')
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help='Use the workers of a "dask scheduler", tcp://HOST:PORT.')
    ] = None,
    fast: Annotated[
        bool, typer.Option('--fast', help="Take the file's quick form; NAME becomes NAME-fast.")
    ] = False,
) -> None:
    """Run scenarios over a grid of parameters or at random, on one or many machines."""
    from khr_sweeps.sweep import sweep as run_sweep

    raise typer.Exit(run_sweep(specification, out, workers, scheduler, fast))


@app.command(name='map')
def draw_stability_map(
    folder: Annotated[Path, typer.Argument(help='The folder of a sweep.')],
    x: Annotated[str, typer.Option('--x', help='Swept parameter, NODE.PARAMETER.')],
    y: Annotated[str, typer.Option('--y', help='Another swept parameter.')],
    out: Annotated[
        Path | None,
        typer.Option(help='The PNG, in the folder by default; CSV files are written beside it.'),
    ] = None,
) -> None:
    """Draw where the runs of a sweep survive, with confidence bounds."""
    from khr_figures.stability import draw_map

    for path in draw_map(folder, x, y, out):
        print(path)


@app.command()
def report(
    run: Annotated[Path, typer.Argument(help='The folder of a run, or its bag.')],
    against: Annotated[Path | None, typer.Option(help='Another run to compare it with.')] = None,
    out: Annotated[
        Path | None, typer.Option(help="The page; report.html in the run's folder by default.")
    ] = None,
) -> None:
    """Write a page about a run, or one that compares two: signals, spectra, parameters."""
    from khr_report.run_page import report as write

    print(write(run, against, out))


@app.command(name='verify')
def verify_bag(
    bag: Annotated[Path, typer.Argument(help='A bag, or the folder of its run.')],
) -> None:
    """Repeat a recorded run; exit with 1 if the trajectory differs."""
    from khr_bringup.verify import verify

    raise typer.Exit(verify(bag))


@app.command(name='recover')
def recover_bag(
    bag: Annotated[Path, typer.Argument(help='A bag, or the folder of a run.')],
) -> None:
    """Repair the bag of a recorder that was killed; the cut one is kept beside it."""
    from khr_bringup.recover import recover

    found = recover(bag)
    if found is None:
        print(f'{bag}: whole')
        return
    print(f'{found.bag}: {found.messages} messages up to t = {found.seconds:.3f} s')
    print(f'the cut bag is kept as {found.kept}')


def main() -> None:
    """Run the command; a user's mistake is one line on stderr and exit code 2."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does
    try:
        sys.exit(app(standalone_mode=False) or 0)
    except TyperException as error:
        _leave(_usage(error), error.exit_code)
    except RunError as error:
        _leave(str(error), 1)
    except KhrError as error:
        _leave(str(error), 2)
    except OSError as error:
        where = f'{str(error.filename)!r}: ' if error.filename is not None else ''
        _leave(f'{where}{error.strerror or error}', 2 if where else 1)
    except KeyboardInterrupt:
        _leave('interrupted', 130)
    except MemoryError:
        _leave('out of memory; accepted: a larger limit (ulimit -v)', 1)


def _usage(error: TyperException) -> str:
    """Return one line about a mistake on the command line; empty after the help was printed."""
    text = ' '.join(error.format_message().split()).rstrip('.')
    context = getattr(error, 'ctx', None)
    return f'{text}; see {context.command_path} --help' if text and context else text


def _leave(text: str, code: int) -> None:
    if text:
        print(f'khr: {text}', file=sys.stderr)
    sys.exit(code)


if __name__ == '__main__':
    main()
