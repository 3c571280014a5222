"""The verb that pushes the robot: its limits, and the recovery step."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from khr.cli.verbs.options import ProcessesOption, SeedsOption, refuse_given
from khr_common.errors import KhrError

# Pushes of khr push, as its options take them.
KA, DURATIONS = '0,12,18', '0.1,0.2,0.5'
DIRECTIONS, GYROS = 'front,behind', 'packaged,circuit'
SEEDS, CANDIDATES = 5, 200  # of khr push --recovery


def push(
    ka: Annotated[
        str, typer.Option(help='Ankle gains K_A, separated by commas; 0 is no control.')
    ] = KA,
    duration: Annotated[
        str, typer.Option(help='Durations of the pushes in s, separated by commas.')
    ] = DURATIONS,
    direction: Annotated[
        str, typer.Option(help='Where the pushes come from, separated by commas: front, behind.')
    ] = DIRECTIONS,
    gyro: Annotated[
        str, typer.Option(help='Gyro models, separated by commas: packaged, circuit.')
    ] = GYROS,
    out: Annotated[
        Path | None,
        typer.Option(help='Folder for push.csv and push.md; only printed if left out.'),
    ] = None,
    recovery: Annotated[
        bool,
        typer.Option(
            '--recovery',
            help='Measure instead at every strength of push whether the recovery step saves the '
            'robot; writes recovery.md, .csv and .png into --out, docs by default.',
        ),
    ] = False,
    seeds: SeedsOption = SEEDS,
    workers: ProcessesOption = None,
    measured: Annotated[
        bool,
        typer.Option(
            '--measured', help='With --recovery: write the page from the data, without runs.'
        ),
    ] = False,
    search: Annotated[
        bool,
        typer.Option(
            '--search',
            help='With --recovery: optimise the step for pushes from --direction '
            'instead; writes recovery.yaml into --out, runs/recovery_search by default. The same '
            'command resumes.',
        ),
    ] = False,
    candidates: Annotated[
        int, typer.Option(help='With --search: candidates of each search.')
    ] = CANDIDATES,
) -> None:
    """Find the largest push that the standing robot survives, and compare it with the model's."""
    of_search, of_study = candidates != CANDIDATES, seeds != SEEDS
    refuse_given(
        (
            ('--search', search and not recovery, 'without --recovery'),
            ('--measured', measured and not recovery, 'without --recovery'),
            ('--seeds', of_study and not recovery, 'without --recovery'),
            ('--candidates', of_search and not search, 'without --recovery --search'),
            ('--measured', measured and search, 'with --search, which has no page'),
            ('--seeds', of_study and search, 'with --search, which has seeds of its own'),
            ('--seeds', of_study and measured, 'with --measured, which runs nothing'),
        )
    )
    from khr_studies.push import limits as push_limits

    if recovery:
        own = (ka, duration, DIRECTIONS if search else direction, gyro)
        if own != (KA, DURATIONS, DIRECTIONS, GYROS):
            raise KhrError(
                '--recovery: has pushes of its own; accepted: without --ka, --duration, --gyro, '
                'and without --direction unless --search'
            )
        if search:
            _search_recovery(push_limits.words('--direction', direction), candidates, workers, out)
        else:
            _push_with_recovery(out or Path('docs'), seeds, workers, measured)
        return
    from khr_report.output import check_folder, make_folder
    from khr_studies.push import page as push_page
    from khr_sweeps.pool import local_pool

    if out:
        check_folder(out)
    conditions = push_limits.conditions(
        push_limits.numbers('--ka', ka),
        push_limits.numbers('--duration', duration),
        push_limits.words('--direction', direction),
        push_limits.words('--gyro', gyro),
    )
    with local_pool(workers) as pool:
        table = push_limits.push_table(conditions, pool)
    print(push_page.largest_pushes(table))
    if out:
        make_folder(out)
        print(*push_page.write(table, out), sep='\n')


def _push_with_recovery(out: Path, seeds: int, workers: int | None, measured: bool) -> None:
    from khr_report.output import check_folder
    from khr_studies.measuring.run_table import read_table
    from khr_studies.recovery import page, study

    check_folder(out)
    path = out / 'recovery.md'
    runs = (
        read_table(path.with_suffix('.csv'))
        if measured
        else study.study(seeds=seeds, workers=workers)
    )
    print(page.write(runs, path))


def _search_recovery(
    directions: list[str], candidates: int, workers: int | None, out: Path | None
) -> None:
    from khr_studies.recovery import search

    folder = out or search.ROOT
    asked = [search.Search(direction, candidates) for direction in directions]  # type: ignore[arg-type]
    print(search.write([search.search(each, workers, folder) for each in asked], folder))
