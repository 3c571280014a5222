"""``khr sweep``: run scenarios over a grid or at random, on one or many machines."""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.table import Table

from khr_bringup.code_version import code_version
from khr_sweeps.errors import SweepError
from khr_sweeps.folder import Folder, read_results
from khr_sweeps.progress import Bar
from khr_sweeps.reading import load
from khr_sweeps.specification import Sweep

INTERRUPTED = 130  # the shell's exit code for SIGINT


def sweep(
    file: Path,
    out: Path | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    fast: bool = False,
    summary: bool = True,
) -> int:
    """Compute the missing runs of a sweep and keep them in its folder; return the exit code.

    Args:
        file: the sweep's specification.
        out: its folder; ``runs/NAME`` by default. Runs in it are not repeated.
        workers: processes to start on this machine; as many as it has cores by default.
        scheduler: address of a Dask scheduler, whose workers are used instead.
        fast: whether to run the quick form of the specification.
        summary: whether to print how many runs ended how.

    Raises:
        SweepError: if the specification or an option is not accepted.
        RunError: if the sweep could not go on; what is finished is kept.
    """
    check_workers(workers, scheduler)
    specification = load(file, fast)
    version = code_version()
    specification.left(version, {})  # refuses values that contradict one another
    with Folder(
        out or Path('runs') / (f'{file.stem}-fast' if fast else file.stem),
        {'version': version, **specification.record()},
    ) as folder:
        left = specification.left(version, folder.verdicts())
        total = left + len(folder.finished())
        lost, stopped = 0, False
        if left:
            count = min(workers or os.cpu_count() or 1, left)
            lost, stopped = _run(specification, folder, total, count, scheduler)
        if summary:
            _summarise(specification, folder)
    report_lost(lost)
    return INTERRUPTED if stopped else 1 if lost else 0


def check_workers(workers: int | None, scheduler: str | None = None) -> None:
    """Check the number of workers.

    Raises:
        SweepError: if it is below 1, or given beside a scheduler.
    """
    if workers is not None and (workers < 1 or scheduler is not None):
        raise SweepError(
            f'--workers: {workers} is not accepted; accepted: an integer from 1 '
            'on, without --scheduler'
        )


def report_lost(runs: int) -> None:
    """Print how many runs are missing and how to compute them; nothing if there are none."""
    if runs:
        print(
            f'khr: {runs} runs lost their worker several times; repeat the command to try them '
            'again',
            file=sys.stderr,
        )


def _run(
    specification: Sweep, folder: Folder, total: int, workers: int, scheduler: str | None
) -> tuple[int, bool]:
    """Compute the missing runs; return how many were lost, and whether it was interrupted."""
    from khr_sweeps.cluster import connected
    from khr_sweeps.runner import run_missing

    lost, verdicts = 0, Counter[str]()
    with Bar('starting', total, len(folder.finished())) as bar:
        try:
            with connected(workers, scheduler) as client:
                bar.name(specification.name)
                for batch in run_missing(client, [(specification, folder)]):
                    rows = [row for row in batch if row is not None]
                    lost += len(batch) - len(rows)
                    verdicts.update(row['verdict'] or 'refused' for row in rows)
                    bar.advance(
                        len(rows),
                        '  '.join(
                            f'{verdict} {count}' for verdict, count in sorted(verdicts.items())
                        ),
                    )
        except KeyboardInterrupt:
            return lost, True
    return lost, False


def _summarise(specification: Sweep, folder: Folder) -> None:
    path = folder.export()
    rows = read_results(path)
    verdicts = Counter(rows.column('verdict').to_pylist())
    summary = Table(title=specification.name, show_header=False, title_justify='left')
    total = rows.num_rows + specification.left(code_version(), folder.verdicts())
    summary.add_row('runs', f'{rows.num_rows} of {total}')
    for verdict, count in sorted(verdicts.items(), key=lambda item: str(item[0])):
        summary.add_row(verdict or 'refused', str(count))
    summary.add_row('results', str(path))
    Console().print(summary)
