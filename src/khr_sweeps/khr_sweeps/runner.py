"""Compute the missing runs of sweeps on a cluster and keep them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from distributed import Client

from khr_bringup.code_version import code_version
from khr_sweeps.cluster import compute
from khr_sweeps.folder import Folder
from khr_sweeps.specification import Sweep
from khr_sweeps.trial import Row, Trial, run_trial

if TYPE_CHECKING:
    from khr_bringup.run_signals import Series


def run_missing(
    client: Client, sweeps: Sequence[tuple[Sweep, Folder]]
) -> Iterator[list[Row | None]]:
    """Compute the runs missing in the folders of sweeps; yield batches of rows after writing them.

    A run that belongs to several sweeps or cases is computed once. Workers need no access to the
    folders: signals are returned with the results and written here.

    Args:
        client: of the cluster, from :func:`khr_sweeps.cluster.connected`.
        sweeps: each with its open folder.

    Yields:
        Rows; None for a run whose workers died repeatedly.

    Raises:
        RunError: if the computation could not go on; what is finished is kept.
    """
    version = code_version()
    wanted: dict[str, list[_Wanted]] = {}  # by run; scenarios would take too much memory
    for trial, folder in _missing(sweeps, version):
        labels = {'id': trial.id, **trial.point, 'seed': trial.seed}
        wanted.setdefault(trial.run, []).append(_Wanted(folder, labels, trial.keep))

    def tasks() -> Iterator[tuple[str, Trial]]:
        begun = set()
        for trial, _ in _missing(sweeps, version):
            if trial.run not in begun:
                begun.add(trial.run)
                yield trial.run, replace(trial, keep=any(each.keep for each in wanted[trial.run]))

    for batch in compute(client, run_trial, tasks()):
        yield _kept([(each, result) for run, result in batch for each in wanted[run]])


class _Wanted(NamedTuple):
    """The folder of a run's row, its columns beside the results, and whether it keeps signals."""

    folder: Folder
    labels: Row
    keep: bool


def _missing(
    sweeps: Sequence[tuple[Sweep, Folder]], version: str
) -> Iterator[tuple[Trial, Folder]]:
    for specification, folder in sweeps:
        finished = folder.finished()
        for trial in specification.trials(version):
            if trial.id not in finished:
                yield trial, folder


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
