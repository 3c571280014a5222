"""Verbs that run many simulations."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from khr import searches
from khr.cli.options_of import options_of
from khr.cli.verbs.options import (
    EngineOption,
    OptimiserSeedOption,
    ProcessesOption,
    SchedulerOption,
    SeedsOption,
    TlsOption,
    ToleranceOption,
    UnauthenticatedOption,
    refuse_given,
    scheduler_of,
    warn_of_switched_off,
)

BOUTS, STAGE3_SEEDS = 50, 2  # defaults
NO_RUNS = 'with --measured, which runs nothing'


def fights(
    out: Annotated[
        Path, typer.Option(help='The page to write, with a .csv and a .png beside it.')
    ] = Path('docs/fights.md'),
    bouts: Annotated[
        int,
        typer.Option(
            min=1, help='Bouts of each combination of settings; the same command resumes.'
        ),
    ] = BOUTS,
    workers: ProcessesOption = None,
    measured: Annotated[
        bool,
        typer.Option('--measured', help='Write page and picture from stored data, without runs.'),
    ] = False,
) -> None:
    """Fight many bouts of two robots: who wins, over gains, stance and recovery step."""
    from khr_report.output import check_page
    from khr_studies.fights import page, study
    from khr_studies.measuring.run_table import read_table

    check_page(out)
    refuse_given([('--bouts', measured and bouts != BOUTS, NO_RUNS)])
    runs = read_table(out.with_suffix('.csv')) if measured else study.study(bouts, workers)
    print(page.write(runs, out))


@options_of(searches.critical)
def critical(arguments: dict[str, Any], settings: list[str]) -> None:
    """Print the limit."""
    from khr_studies.measuring.critical import limit_text
    from khr_sweeps.pool import local_pool

    condition, out = searches.condition_of(**arguments), arguments['out']
    warn_of_switched_off(condition.scenario(0.0), settings)
    with local_pool(arguments['workers'], '--workers') as pool:
        limit = searches.limit_of(condition, arguments['seeds'], arguments['tolerance'], out, pool)
    print(limit_text(condition.title, limit))
    if out:
        print(out)


@options_of(searches.tune)
def tune(arguments: dict[str, Any], _: list[str]) -> None:
    """Write the results and print their summary."""
    from khr_studies.tuning import page, study

    question = searches.question_of(**arguments)
    folder = arguments['out'] or question.folder
    print(page.write(study.tune(question, arguments['workers'], folder / 'jobs'), folder))


def calibrate(
    config: Annotated[
        Path | None,
        typer.Option(help='Constants and values to fit; the shipped calibration.yaml by default.'),
    ] = None,
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/calibration.md'),
    members: Annotated[
        Path, typer.Option(help='JSON file to write, of the robots that fit.')
    ] = Path('config/ensemble.json'),
    journal: Annotated[
        Path,
        typer.Option(
            help='The measured candidates; the same command resumes from it, on any machine.'
        ),
    ] = Path('runs/calibration.sqlite'),
    engine: EngineOption = 'mujoco',
    candidates: Annotated[int, typer.Option(help='Candidates of the search.')] = 600,
    confirm: Annotated[
        int, typer.Option(help='Number of best candidates to measure again on both engines.')
    ] = 50,
    population: Annotated[int, typer.Option(help='Candidates of a generation.')] = 10,
    seed: OptimiserSeedOption = 0,
    seeds: SeedsOption = 1,
    workers: ProcessesOption = None,
    scheduler: SchedulerOption = None,
    tls: TlsOption = None,
    unauthenticated: UnauthenticatedOption = False,
) -> None:
    """Search the free constants for the best agreement with all rows of the thesis."""
    from khr_studies.calibration import page, study
    from khr_studies.calibration.ensemble import ensemble_members
    from khr_studies.calibration.plan import SHIPPED_PLAN, read_plan
    from khr_studies.calibration.search import Search
    from khr_studies.measuring.json_file import write_json

    config = config or SHIPPED_PLAN
    page.check_files(out, members, journal, config)
    plan = read_plan(config)
    made = Search(plan, engine, seed, seeds, population, candidates)
    cluster = scheduler_of(scheduler, tls, unauthenticated)
    found, measured = study.calibrate(made, journal, confirm, workers, cluster)
    said = page.write(found, measured, out)
    write_json(members, ensemble_members(plan, found.found))
    print(said)


def engines(
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/engines.md'),
    seeds: SeedsOption = 3,
    tolerance: ToleranceOption = 0.1,
    jobs: ProcessesOption = None,
    only: Annotated[
        str | None,
        typer.Option(help='Scenarios, separated by commas; all shipped ones by default.'),
    ] = None,
) -> None:
    """Run every scenario and limit on both physics engines, and list the differences."""
    from khr_report.output import check_page
    from khr_studies.engines import page, study

    check_page(out)
    print(f'{out}: {page.write(study.compare_engines(seeds, tolerance, jobs, only), out)}')


def stage3(
    out: Annotated[
        Path, typer.Option(help='The page to write; data and plots go into the same folder.')
    ] = Path('docs/stage3.md'),
    seeds: SeedsOption = STAGE3_SEEDS,
    engine: EngineOption = 'mujoco',
    jobs: ProcessesOption = None,
    measured: Annotated[
        bool,
        typer.Option('--measured', help='Write page and picture from stored data, without runs.'),
    ] = False,
) -> None:
    """Explain the third stage of standing: how far the hip's damping raises the limit."""
    from khr_report.output import check_page
    from khr_studies.third_stage import page
    from khr_studies.third_stage.comparison import compare_with_model
    from khr_studies.third_stage.study import Plane, measure_plane

    check_page(out)
    refuse_given(
        (
            ('--seeds', measured and seeds != STAGE3_SEEDS, NO_RUNS),
            ('--engine', measured and engine != 'mujoco', NO_RUNS),
        )
    )
    kept = out.with_suffix('.csv')
    plane = Plane.read(kept) if measured else measure_plane(seeds, engine, jobs)
    print(page.write(plane, compare_with_model(plane), out))


def start_sweep(
    specification: Annotated[Path, typer.Argument(help='A sweep file.')],
    out: Annotated[
        Path | None,
        typer.Option(
            help='Folder of the results, runs/NAME by default; runs already in it are kept.'
        ),
    ] = None,
    workers: ProcessesOption = None,
    scheduler: SchedulerOption = None,
    tls: TlsOption = None,
    unauthenticated: UnauthenticatedOption = False,
    fast: Annotated[
        bool, typer.Option('--fast', help="Take the file's quick form; NAME becomes NAME-fast.")
    ] = False,
) -> None:
    """Run scenarios over a grid of parameters or at random, on one or many machines."""
    from khr_common.errors import INTERRUPTED
    from khr_sweeps.reading import load_sweep
    from khr_sweeps.sweep import run_sweep

    known = scheduler_of(scheduler, tls, unauthenticated)
    folder = out or Path('runs') / (specification.stem + '-fast' * fast)
    code = run_sweep(load_sweep(specification, fast), folder, workers, known)
    if code == INTERRUPTED:
        print('khr: interrupted; repeat the command to go on', file=sys.stderr)
    raise typer.Exit(code)


def draw_stability_map(
    folder: Annotated[Path, typer.Argument(help='The folder of a sweep.')],
    x: Annotated[str, typer.Option('--x', help='Swept parameter, NODE.PARAMETER.')],
    y: Annotated[str, typer.Option('--y', help='Another swept parameter.')],
    out: Annotated[
        Path | None,
        typer.Option(
            help='The picture, .png, .pdf or .svg, in the folder by default; CSV files are written '
            'next to it.'
        ),
    ] = None,
    where: Annotated[
        list[str] | None,
        typer.Option(
            help='Take only the runs with NODE.PARAMETER=VALUE, scenario=NAME or case=LABEL; '
            'repeatable.'
        ),
    ] = None,
) -> None:
    """Draw where the runs of a sweep survive, with confidence bounds."""
    from khr_studies.stability_map.page import draw_map

    selected = dict(map(_selection, where or ()))
    for path in draw_map(folder, x, y, out, selected, print):
        print(path)


def _selection(text: str) -> tuple[str, Any]:
    """Read ``node.parameter=value``, or the name of a scenario or case."""
    from khr_bringup.scenario.scenario import parse_change
    from khr_sweeps.axes import LABELS

    name, equals, label = text.partition('=')
    if equals and name in LABELS:
        return name, label
    (node, key), value = parse_change(text)
    return f'{node}.{key}', value


def slope_gains(
    folder: Annotated[
        Path,
        typer.Argument(
            help='The folder of a sweep over inclination and gains, such as that of '
            'config/sweeps/slope_gains.yaml.'
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help='The table as Markdown, with all gains as CSV beside it.')
    ] = None,
) -> None:
    """List the gains that hold each slope, and their cost in vibration and slip."""
    from khr_report.output import check_page
    from khr_studies.stability_map.page import gains_page, slope_gains, write_gains
    from khr_sweeps.results.folder import read_results

    if out:
        check_page(out)
    found = slope_gains(read_results(folder))
    print(gains_page(found))
    for path in write_gains(found, out) if out else []:
        print(path)
