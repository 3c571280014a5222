"""Compute the missing runs of sweeps on a pool and keep them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from khr_bringup.code_version import code_version
from khr_sweeps.pool import Pool, compute
from khr_sweeps.results.folder import Folder
from khr_sweeps.specification import Sweep
from khr_sweeps.trial import Row, Trial, run_trial

if TYPE_CHECKING:
    from khr_bringup.recorded.run_signals import Series


class _Target(NamedTuple):
    """The folder of a run's row, its columns beside the results, and whether it keeps signals."""

    folder: Folder
    labels: Row
    keep: bool


def run_missing(pool: Pool, sweeps: Sequence[tuple[Sweep, Folder]]) -> Iterator[list[Row | None]]:
    """Compute the missing runs of sweeps; yield batches of rows after writing them.

    A run that belongs to several sweeps or cases is computed once. A sweep that bisects takes
    several rounds; the results of one determine the runs of the next. Workers need no access to
    the folders: signals are returned with the results and written here.

    Yields:
        Rows; None for a run over which several workers were lost.

    Raises:
        RunError: if the computation cannot go on; finished runs are kept.
    """
    tried: set[str] = set()
    left = sweeps
    while left:
        yield from _round(pool, left, tried)
        left = [
            (sweep, folder)
            for sweep, folder in sweeps
            if sweep.bisect
            and any(
                trial.run not in tried for trial in sweep.due(code_version(), folder.finished())
            )
        ]


def _round(
    pool: Pool, sweeps: Sequence[tuple[Sweep, Folder]], tried: set[str]
) -> Iterator[list[Row | None]]:
    """Compute the runs that are due and not in ``tried``; add them to it."""
    due = [(sweep, folder, folder.finished()) for sweep, folder in sweeps]

    def missing() -> Iterator[tuple[Trial, Folder]]:
        for sweep, folder, finished in due:
            for trial in sweep.due(code_version(), finished):
                if trial.run not in tried:
                    yield trial, folder

    targets: dict[str, list[_Target]] = {}  # by run; trials would take too much memory
    for trial, folder in missing():
        labels = {'id': trial.id, **trial.point, 'seed': trial.seed}
        targets.setdefault(trial.run, []).append(_Target(folder, labels, trial.keep))

    def tasks() -> Iterator[tuple[str, Trial]]:
        for trial, _ in missing():
            tried.add(trial.run)
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
