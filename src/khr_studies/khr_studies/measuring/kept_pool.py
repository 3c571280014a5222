"""A pool of processes that keeps the results of finished jobs: an interrupted study resumes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any

from khr_studies.measuring.study_version import version_of_study
from khr_sweeps.pool import local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.kept_jobs import KeptJobs


@contextmanager
def kept_pool(
    study: str,
    title: str,
    workers: int | None,
    folder: Path,
    quiet: bool = False,
    runs: int = 0,
    costs: Mapping[Callable[..., Any], int] = MappingProxyType({}),
) -> Iterator[KeptJobs]:
    """Yield a pool on this machine that keeps the results of a study's jobs.

    Args:
        study: module that imports all that its jobs call.
        title: of the progress bar.
        runs: number of all runs, if it is known beforehand.
        costs: number of runs of a job by function; 1 for others.
    """
    with (
        local_pool(workers, '--workers') as pool,
        ProgressBar(title, runs, lines=True, quiet=quiet, final=runs > 0) as bar,
        KeptJobs(pool, folder, version_of_study(study), bar, dict(costs)) as kept,
    ):
        yield kept
