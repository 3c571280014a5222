"""``khr sweep``: many runs of one scenario, over a grid or at random, on one or many machines."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.table import Table

from khr_bringup.errors import BringupError
from khr_bringup.sweeps.folder import Folder
from khr_bringup.sweeps.specification import Specification, load
from khr_bringup.sweeps.trial import run_trial
from khr_bringup.sweeps.version import code_version

INTERRUPTED = 130  # the shell's exit code for SIGINT


def sweep(file: Path, out: Path | None = None, workers: int | None = None,
          scheduler: str | None = None) -> int:
    """Run what a sweep still lacks, keep every run in its folder; return the exit code.

    Args:
        file: the sweep's specification.
        out: its folder; ``runs/NAME`` by default. Runs that it holds are not repeated.
        workers: processes to start on this machine; as many as it has cores by default.
        scheduler: address of a Dask scheduler, whose workers are used instead.

    Raises:
        BringupError: if the specification or an option is not accepted.
        RunError: if the sweep could not go on; what is finished is kept.
    """
    if workers is not None and (workers < 1 or scheduler is not None):
        raise BringupError(f'--workers: {workers} is not accepted; accepted: an integer from 1 '
                           'on, without --scheduler')
    specification = load(file)
    version = code_version()
    planned = {trial.id for trial in specification.trials(version)}
    with Folder(out or Path('runs') / file.stem,
                {'version': version, **specification.record()}) as folder:
        left = len(planned - folder.finished())
        lost, stopped = 0, False
        if left:
            count = min(workers or os.cpu_count() or 1, left)
            lost, stopped = _run(specification, folder, len(planned), count, scheduler)
        _summarise(specification, folder, len(planned))
    if lost:
        Console(stderr=True).print(f'khr: {lost} runs lost their worker several times; repeat '
                                   'the command to try them again', highlight=False)
    return INTERRUPTED if stopped else 1 if lost else 0


def _run(specification: Specification, folder: Folder, total: int, workers: int,
         scheduler: str | None) -> tuple[int, bool]:
    """Compute what the folder lacks; return how many runs were lost, and whether it was cut."""
    from khr_bringup.sweeps.cluster import compute, connected

    finished = folder.finished()
    tasks = ((trial.id, trial) for trial in specification.trials(code_version())
             if trial.id not in finished)
    lost, verdicts = 0, Counter[str]()
    columns = (TextColumn('{task.description}'), BarColumn(), MofNCompleteColumn(),
               TimeElapsedColumn(), TextColumn('left'), TimeRemainingColumn(),
               TextColumn('{task.fields[text]}'))
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True,
                  disable=not console.is_terminal) as progress:
        bar = progress.add_task('starting', total=total, completed=len(finished), text='')
        try:
            with connected(workers, scheduler) as client:
                progress.update(bar, description=Path(specification.file).stem)
                for batch in compute(client, run_trial, tasks):
                    rows = [row for _, row in batch if row is not None]
                    folder.append(rows)
                    lost += len(batch) - len(rows)
                    verdicts.update(row['verdict'] or 'refused' for row in rows)
                    progress.update(bar, advance=len(rows), text='  '.join(
                        f'{verdict} {count}' for verdict, count in sorted(verdicts.items())))
        except KeyboardInterrupt:
            return lost, True
    return lost, False


def _summarise(specification: Specification, folder: Folder, total: int) -> None:
    from khr_bringup.sweeps.folder import read_table

    path = folder.export()
    rows = read_table(path)
    verdicts = Counter(rows.column('verdict').to_pylist())
    table = Table(title=Path(specification.file).stem, show_header=False, title_justify='left')
    table.add_row('runs', f'{rows.num_rows} of {total}')
    for verdict, count in sorted(verdicts.items(), key=lambda item: str(item[0])):
        table.add_row(verdict or 'refused', str(count))
    table.add_row('results', str(path))
    Console().print(table)
