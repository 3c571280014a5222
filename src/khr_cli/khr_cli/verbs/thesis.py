"""Verbs that put the thesis beside the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from khr_cli.verbs.options import (
    EngineOption,
    JobsOption,
    SeedsOption,
    SetOption,
    ToleranceOption,
    WorkersOption,
)
from khr_sim import engines


def figure(
    numbers: Annotated[
        list[str], typer.Argument(help='Figures of the thesis, such as 3.8 5.9, or all.')
    ],
    out: Annotated[Path, typer.Option(help='Folder for PNG and CSV.')] = Path('figures'),
    fast: Annotated[
        bool, typer.Option('--fast', help='Use the quick, coarse form of its experiments.')
    ] = False,
    signal: Annotated[
        str | None,
        typer.Option(
            help='Pitch rate of runs: gyro_rate, as in the thesis, or pitch_rate, the true one.'
        ),
    ] = None,
) -> None:
    """Draw figures of the thesis from its models, or from experiments, which are run first."""
    from khr_report.reproduce import figures

    for path in figures(numbers, out, fast, signal):
        print(path)


def reproduce(
    only: Annotated[
        str | None,
        typer.Option(help='Figures, maps and "scoreboard", separated by commas; all by default.'),
    ] = None,
    fast: Annotated[
        bool, typer.Option('--fast', help='Use the quick, coarse form: minutes.')
    ] = False,
    out: Annotated[Path, typer.Option(help='Folder of the page.')] = Path('report'),
    workers: WorkersOption = None,
    findings: Annotated[
        Path | None,
        typer.Option(help='The findings as Markdown; findings.md in the folder by default.'),
    ] = None,
    engine: EngineOption = engines.DEFAULT,
) -> None:
    """Run every experiment of the thesis anew, draw every figure, and write one page."""
    from khr_report.reproduce import reproduce as run_all

    raise typer.Exit(run_all(out, only, fast, workers, findings, engine))


def lines(
    scenario: Annotated[
        str, typer.Argument(help='A walking scenario: file or name.')
    ] = 'walk_6.99deg_ka12',
    fast: Annotated[bool, typer.Option('--fast', help='One seed: no intervals.')] = False,
    out: Annotated[Path | None, typer.Option(help='The Markdown file to write as well.')] = None,
    set_: SetOption = None,
    workers: WorkersOption = None,
) -> None:
    """Attribute a walk's spectral peaks to gait, feedback or slip."""
    from khr_report.peak_origin_page import peak_origin

    print(peak_origin(scenario, fast, workers, out, set_ or []))


def scoreboard(
    out: Annotated[Path, typer.Option(help='The page to write.')] = Path('docs/scoreboard.md'),
    seeds: SeedsOption = 3,
    tolerance: ToleranceOption = 0.2,
    jobs: JobsOption = 2,
    explain: Annotated[
        bool,
        typer.Option(
            '--explain/--no-explain',
            help='Search for what explains each miss; measure limits uphill.',
        ),
    ] = True,
) -> None:
    """Measure every row of the thesis on the simulated robot and write the scoreboard."""
    from khr_report.scoreboard_page import write

    print(f'{out}: {write(out, seeds, tolerance, jobs, explain)}')
