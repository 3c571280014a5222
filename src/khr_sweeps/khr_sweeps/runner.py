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


def run_missing(pool: Pool, sweeps: Sequence[tuple[Sweep, Folder]]) -> Iterator[list[Row | None]]:
    """Compute the runs missing in the folders of sweeps; yield batches of rows after writing them.

    A run that belongs to several sweeps or cases is computed once. A sweep that bisects takes
    several rounds, each with the runs that follow from those before. Workers need no access to the
    folders: signals are returned with the results and written here.

    Args:
        pool: of workers.
        sweeps: each with its open folder.

    Yields:
        Rows; None for a run whose workers died repeatedly.

    Raises:
        RunError: if the computation could not go on; what is finished is kept.
    """
    tried: set[str] = set()
    left = sweeps
    while left:
        yield from _round(pool, left, tried)
        left = [  # a run whose worker died was tried
            (each, folder)
            for each, folder in sweeps
            if each.bisect
            and any(
                trial.run not in tried for trial in each.due(code_version(), folder.finished())
            )
        ]


def _round(
    pool: Pool, sweeps: Sequence[tuple[Sweep, Folder]], tried: set[str]
) -> Iterator[list[Row | None]]:
    """Compute the runs that are due and were not tried, and note them as tried."""
    due = [(each, folder, folder.finished()) for each, folder in sweeps]
    version = code_version()

    def missing() -> Iterator[tuple[Trial, Folder]]:
        for each, folder, finished in due:
            for trial in each.due(version, finished):
                yield trial, folder

    wanted: dict[str, list[_Wanted]] = {}  # by run; scenarios would take too much memory
    for trial, folder in missing():
        if trial.run not in tried:
            labels = {'id': trial.id, **trial.point, 'seed': trial.seed}
            wanted.setdefault(trial.run, []).append(_Wanted(folder, labels, trial.keep))

    def tasks() -> Iterator[tuple[str, Trial]]:
        for trial, _ in missing():
            if trial.run not in tried:
                tried.add(trial.run)
                yield trial.run, replace(trial, keep=any(each.keep for each in wanted[trial.run]))

    for batch in compute(pool, run_trial, tasks()):
        yield _kept([(each, result) for run, result in batch for each in wanted[run]])


class _Wanted(NamedTuple):
    """The folder of a run's row, its columns beside the results, and whether it keeps signals."""

    folder: Folder
    labels: Row
    keep: bool


def _kept(batch: Sequence[tuple[_Wanted, tuple[Row, Series | None] | None]]) -> list[Row | None]:
    """Write results to the folders that want them; return the rows."""
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
