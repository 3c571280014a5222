"""Verbs that compare the robot with the thesis."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from khr.cli.verbs.options import (
    AxisOption,
    EngineOption,
    NamespaceOption,
    ProcessesOption,
    RobotOption,
    SeedsOption,
    SetOption,
    ToleranceOption,
    TopicOption,
    recording_named,
    refuse_given,
)
from khr_common.errors import KhrError
from khr_sim.physics import engines


def figure(
    numbers: Annotated[
        list[str], typer.Argument(help='Figures, such as 3.8 5.9 open_loops, or all.')
    ],
    out: Annotated[
        Path, typer.Option(help='Folder for PNG and CSV, or one file, .png, .pdf or .svg.')
    ] = Path('figures'),
    columns: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=2,
            help='Width for a paper, in columns of its page: 1 or 2. Heading and notes are printed '
            'instead of drawn, as for .pdf and .svg.',
        ),
    ] = None,
    fast: Annotated[
        bool, typer.Option('--fast', help='Run shorter, coarser experiments.')
    ] = False,
    signal: Annotated[
        str | None,
        typer.Option(
            help='Pitch rate of runs: gyro_rate, as in the thesis, or pitch_rate, the true one.'
        ),
    ] = None,
    engine: EngineOption = engines.DEFAULT,
    robot: RobotOption = '',
) -> None:
    """Draw figures of the thesis from its models, or from experiments, which are run first."""
    from khr_report.plots.plot_style import PICTURES
    from khr_studies.thesis_figures import registry

    asked = registry.expand_numbers(numbers)
    if len(asked) > 1 and out.suffix in PICTURES:
        raise KhrError.refused('--out', str(out), f'a folder, for {len(asked)} figures')
    if out.suffix[1:].isalpha() and out.suffix not in PICTURES and not out.is_dir():
        raise KhrError.refused('--out', str(out), f'a folder, or a name in {", ".join(PICTURES)}')
    runs = registry.run_experiments(asked, fast, engine, robot)
    console = Console(stderr=True)
    for place, number in enumerate(asked, 1):
        with console.status(f'drawing figure {number}, {place} of {len(asked)}'):
            paths = registry.draw(
                number, out, runs, fast, signal, engine, columns, print, robot=robot
            )
        for path in paths:
            print(path)


def reproduce(
    only: Annotated[
        str | None,
        typer.Option(help='Figures, maps and "scoreboard", separated by commas; all by default.'),
    ] = None,
    fast: Annotated[
        bool, typer.Option('--fast', help='Run shorter, coarser experiments: minutes.')
    ] = False,
    out: Annotated[Path, typer.Option(help='Folder of the page.')] = Path('report'),
    workers: ProcessesOption = None,
    findings: Annotated[
        Path | None,
        typer.Option(help='The findings as Markdown; findings.md in the folder by default.'),
    ] = None,
    engine: EngineOption = engines.DEFAULT,
) -> None:
    """Repeat every experiment of the thesis, draw every figure, and write one page."""
    from khr_common.errors import INTERRUPTED
    from khr_report.output import check_page
    from khr_studies.reproduction import page
    from khr_studies.reproduction.experiment_plan import parse_plan
    from khr_studies.reproduction.reproduce import reproduce as run_all
    from khr_sweeps.sweep import report_lost

    asked = parse_plan(only, fast, engine)
    if findings:
        check_page(findings, '--findings')
        over = findings.resolve() == (out / 'scoreboard.md').resolve()
        refuse_given([('--findings', over, f'as {findings}, which will be the scoreboard')])
    try:
        results = run_all(asked, out, workers)
    except KeyboardInterrupt:
        print('khr: interrupted; repeat the command to go on', file=sys.stderr)
        raise typer.Exit(INTERRUPTED) from None
    said = page.write(results, out, findings or out / 'findings.md')
    for text in results.failures:
        print(f'khr: {text}', file=sys.stderr)
    report_lost(results.lost)
    print(said)
    if results.failures or results.lost:
        raise typer.Exit(1)


def lines(
    scenario: Annotated[
        str,
        typer.Argument(
            help='A walking scenario: file or name. Or a recording: the folder of a run, or any '
            'rosbag2 (MCAP or SQLite).'
        ),
    ] = 'walk_6.99deg_ka12',
    topic: TopicOption = '',
    axis: AxisOption = '',
    namespace: NamespaceOption = '',
    fast: Annotated[bool, typer.Option('--fast', help='One seed: no intervals.')] = False,
    out: Annotated[Path | None, typer.Option(help='The Markdown file to write as well.')] = None,
    set_: SetOption = None,
    workers: ProcessesOption = None,
) -> None:
    """Attribute a walk's spectral peaks to gait, feedback or slip; list those of a recording."""
    from khr_bringup.recorded.storage import is_recording
    from khr_common.files import write_text
    from khr_report.output import check_page, make_folder
    from khr_studies.peak_origin import page, study

    if out:
        check_page(out)
    path = recording_named(scenario)
    if topic or axis or namespace or path.is_dir() or is_recording(path):
        of_scenario = {'--fast': fast, '--set': set_, '--workers': workers}
        if given := [name for name, each in of_scenario.items() if each]:
            raise KhrError(f'{given[0]}: not accepted with a recording; accepted: a scenario')
        text = page.recorded_page(study.peaks_of_recording(path, topic, axis, namespace))
    else:
        runs = study.run_variants(scenario, fast, workers, changed=set_ or [])
        text = page.page(study.study(runs))
    if out:
        make_folder(out.parent)
        write_text(out, text)
    print(text)


def scoreboard(
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/scoreboard.md'),
    seeds: SeedsOption = 3,
    tolerance: ToleranceOption = 0.2,
    jobs: ProcessesOption = None,
    explain: Annotated[
        bool,
        typer.Option(
            '--explain/--no-explain',
            help='Search for the cause of each miss; measure limits uphill.',
        ),
    ] = True,
    robot: RobotOption = '',
    engine: EngineOption = engines.DEFAULT,
) -> None:
    """Measure every published value of the thesis on the simulated robot; write the scoreboard."""
    from khr_report.output import check_page
    from khr_studies.scoreboard import page, study

    check_page(out)
    board = study.scoreboard(seeds, tolerance, jobs, explain, robot, engine)
    print(f'{out}: {page.write(board, out)}')
