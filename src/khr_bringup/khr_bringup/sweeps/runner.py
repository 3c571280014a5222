"""The runs that sweeps still lack, computed on a cluster and kept."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from distributed import Client

from khr_bringup.sweeps.cluster import compute
from khr_bringup.sweeps.folder import Folder
from khr_bringup.sweeps.specification import Specification
from khr_bringup.sweeps.trial import Row, Trial, identity, run_trial
from khr_bringup.sweeps.version import code_version


def run_missing(client: Client,
                sweeps: Sequence[tuple[Specification, Folder]]) -> Iterator[list[Row | None]]:
    """Compute what the folders of several sweeps lack; yield batches of rows that are kept.

    Workers need not see the folders: signals come back with the row and are written here.

    Args:
        client: of the cluster, from :func:`khr_bringup.sweeps.cluster.connected`.
        sweeps: each with its open folder.

    Yields:
        Rows; None for a run whose workers died again and again.

    Raises:
        RunError: if the computation could not go on; what is finished is kept.
    """
    version = code_version()
    # The same parameters may be a run of several sweeps, whose rows differ in their columns.
    folders = {f'{specification.name}-{identity(specification.record(), version)}': folder
               for specification, folder in sweeps}

    def tasks() -> Iterator[tuple[str, Trial]]:
        for key, (specification, folder) in zip(folders, sweeps, strict=True):
            finished = folder.finished()
            for trial in specification.trials(version):
                if trial.id not in finished:
                    yield f'{key}/{trial.id}', trial

    for batch in compute(client, run_trial, tasks()):
        rows: dict[str, list[Row]] = {}
        for task, result in batch:
            if result is not None:
                row, series = result
                key = task.rpartition('/')[0]
                if series is not None:
                    folders[key].keep(row['id'], series)
                rows.setdefault(key, []).append(row)
        for key, some in rows.items():
            folders[key].append(some)
        yield [None if result is None else result[0] for _, result in batch]
