"""``khr sweep``: run scenarios over a grid or at random, on one or many machines."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rich.console import Console
from rich.table import Table

from khr_bringup.code_version import code_version
from khr_common.errors import INTERRUPTED, KhrError
from khr_sweeps.cluster import Scheduler, open_pool
from khr_sweeps.pool import Pool, check_workers, compute
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.folder import Folder, read_results
from khr_sweeps.specification import Sweep
from khr_sweeps.trial import Row, Trial, run_trial

if TYPE_CHECKING:
    from khr_bringup.recorded.run_signals import Series


def run_sweep(
    specification: Sweep,
    out: Path,
    workers: int | None = None,
    scheduler: Scheduler | None = None,
    quiet: bool = False,
) -> int:
    """Compute the missing runs of a sweep and keep them in its folder; return the exit code.

    Args:
        specification: of the sweep.
        out: its folder; runs in it are not repeated.
        workers: processes on this machine; one per core by default.
        scheduler: of a Dask cluster; its workers are used instead.
        quiet: whether to show neither progress nor a summary.

    Raises:
        KhrError: if the specification or an option is not accepted.
        RunError: if the sweep cannot go on; finished runs are kept.
    """
    most = check_workers(workers)
    if workers is not None and scheduler is not None:
        raise KhrError('--workers: not accepted beside --scheduler; accepted: one of them')
    version = code_version()
    specification.count_missing(version, {})  # refuses contradicting values
    with Folder(out, {'version': version, **specification.record()}) as folder:
        left = specification.count_missing(version, folder.finished())
        total = left + len(folder.finished())
        lost, stopped = 0, False
        if left:
            count = min(most, left)
            lost, stopped = _run(specification, folder, total, count, scheduler, quiet)
        path = folder.export()
        if not quiet:
            _summarise(specification, path)
    report_lost(lost)
    return INTERRUPTED if stopped else 1 if lost else 0


def report_lost(runs: int) -> None:
    """Print the number of lost runs, if any, and how to repeat them."""
    if runs:
        print(
            f'khr: {runs} runs lost their worker several times; repeat the command to try them '
            'again',
            file=sys.stderr,
        )


def _run(
    specification: Sweep,
    folder: Folder,
    total: int,
    workers: int,
    scheduler: Scheduler | None,
    quiet: bool,
) -> tuple[int, bool]:
    """Compute the missing runs; return the number of lost runs, and whether it was interrupted."""
    lost, verdicts, done = 0, Counter[str](), len(folder.finished())
    with ProgressBar('', total, done, quiet=quiet) as bar:
        bar.show('starting', done)
        try:
            with open_pool(workers, scheduler) as pool:
                bar.show(specification.name, done)
                for batch in run_missing(pool, [(specification, folder)]):
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


def _summarise(specification: Sweep, path: Path) -> None:
    rows = read_results(path)
    verdicts = Counter(rows.column('verdict').to_pylist())
    summary = Table(title=specification.name, show_header=False, title_justify='left')
    columns = (rows.column(name).to_pylist() for name in ('id', 'stayed_up'))
    finished = dict(zip(*columns, strict=True))  # from the file: Ctrl-C may have come in between
    total = rows.num_rows + specification.count_missing(code_version(), finished)
    summary.add_row('runs', f'{rows.num_rows} of {total}')
    for verdict, count in sorted(verdicts.items(), key=lambda item: str(item[0])):
        summary.add_row(verdict or 'refused', str(count))
    summary.add_row('results', str(path))
    Console().print(summary)


_Attempt = tuple[Folder, str]  # a folder and the id of its run


class _Target(NamedTuple):
    """The folder of a run's row, its columns beside the results, and whether it keeps signals."""

    folder: Folder
    labels: Row
    keep: bool


def run_missing(pool: Pool, sweeps: Sequence[tuple[Sweep, Folder]]) -> Iterator[list[Row | None]]:
    """Compute the missing runs of sweeps; yield batches of rows after writing them.

    A run that belongs to several sweeps or cases is computed once in a round. A sweep that
    bisects takes several rounds; the results of one determine the runs of the next. Workers need
    no access to the folders: signals are returned with the results and written here.

    Yields:
        Rows; None for a run over which several workers were lost.

    Raises:
        RunError: if the computation cannot go on; finished runs are kept.
    """
    tried: set[_Attempt] = set()
    left = sweeps
    while left:
        yield from _round(pool, left, tried)
        left = [
            (sweep, folder)
            for sweep, folder in sweeps
            if sweep.bisect
            and any(
                (folder, trial.id) not in tried
                for trial in sweep.due(code_version(), folder.finished())
            )
        ]


def _round(
    pool: Pool, sweeps: Sequence[tuple[Sweep, Folder]], tried: set[_Attempt]
) -> Iterator[list[Row | None]]:
    """Compute the runs that are due and not in ``tried``; add them to it."""
    due = [(sweep, folder, folder.finished()) for sweep, folder in sweeps]

    def missing() -> Iterator[tuple[Trial, Folder]]:
        for sweep, folder, finished in due:
            for trial in sweep.due(code_version(), finished):
                if (folder, trial.id) not in tried:
                    yield trial, folder

    targets: dict[str, list[_Target]] = {}  # by run; trials would take too much memory
    for trial, folder in missing():
        labels = {'id': trial.id, **trial.point, 'seed': trial.seed}
        targets.setdefault(trial.run, []).append(_Target(folder, labels, trial.keep))

    def tasks() -> Iterator[tuple[str, Trial]]:
        begun: set[str] = set()
        for trial, folder in missing():
            tried.add((folder, trial.id))
            if trial.run not in begun:
                begun.add(trial.run)
                yield trial.run, replace(trial, keep=any(one.keep for one in targets[trial.run]))

    for batch in compute(pool, run_trial, tasks()):
        yield _write([(target, result) for run, result in batch for target in targets[run]])


def _write(batch: Sequence[tuple[_Target, tuple[Row, Series | None] | None]]) -> list[Row | None]:
    """Write results to their folders; return the rows."""
    rows: list[Row | None] = []
    of_folder: dict[Folder, list[Row]] = {}
    for (folder, labels, keep), result in batch:
        if result is None:
            rows.append(None)
            continue
        results, series = result
        if keep and series is not None:
            folder.keep(labels['id'], series)
        row = labels | results
        rows.append(row)
        of_folder.setdefault(folder, []).append(row)
    for folder, some in of_folder.items():
        folder.append(some)
    return rows
