"""Compute the runs of a sweep on processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import logging
import signal
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from typing import Any, TypeVar
from urllib.parse import urlsplit

import dask
from distributed import Client, KilledWorker, LocalCluster, as_completed

from khr_common import KhrError, RunError
from khr_sweeps.errors import SweepError

CONNECT_TIMEOUT = 5.0  # s of wall time for a scheduler to answer
AHEAD = 4  # runs submitted per worker thread, so that no worker is idle
LEAST_AHEAD = 64  # runs submitted at least, so that workers that join later find some
QUIET = {  # Dask watches its workers from within, which would take a tenth of their time
    'distributed.worker.profile.enabled': False,
    'distributed.admin.tick.interval': '1s',
    'distributed.admin.system-monitor.interval': '10s',
}

Task = TypeVar('Task')
Result = TypeVar('Result')


@contextmanager
def connected(workers: int, scheduler: str | None = None) -> Iterator[Client]:
    """Connect to a scheduler, or start a cluster of single-threaded processes on this machine.

    Args:
        workers: number of processes to start; ignored with a scheduler.
        scheduler: address such as ``tcp://host:8786``.

    Raises:
        SweepError: if no scheduler answers at the address.
    """
    _silence()
    if scheduler is None:
        with _local(workers) as cluster, Client(cluster) as client:
            yield client
        return
    with (
        dask.config.set({'distributed.comm.timeouts.connect': CONNECT_TIMEOUT}),
        _join(scheduler) as client,
    ):
        yield client


def compute(
    client: Client, function: Callable[[Task], Result], tasks: Iterable[tuple[str, Task]]
) -> Iterator[list[tuple[str, Result | None]]]:
    """Apply a function to tasks on the cluster; yield results in batches as they finish.

    Only a window of the tasks is submitted at a time.

    Args:
        client: from :func:`connected`.
        function: importable by the workers.
        tasks: each with a key; tasks with equal keys are considered equal.

    Yields:
        Keys with results; None for a task whose workers died repeatedly.

    Raises:
        RunError: if the function raised, or the scheduler stopped.
    """
    remaining = iter(tasks)

    def submit(count: int) -> list[Any]:
        return [
            client.submit(function, task, key=key, pure=True)
            for key, task in islice(remaining, count)
        ]

    ahead = max(LEAST_AHEAD, AHEAD * sum(client.nthreads().values()))
    waiting = as_completed(submit(ahead), loop=client.loop, with_results=True, raise_errors=False)
    for batch in waiting.batches():
        waiting.update(submit(len(batch)))
        yield [(future.key, _result(future, result)) for future, result in batch]


def _silence() -> None:
    """Suppress the log of Dask: errors are reported here in one line."""
    for name in [*logging.root.manager.loggerDict, 'distributed']:
        if name.split('.')[0] in ('distributed', 'tornado', 'asyncio'):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)


def _local(workers: int) -> LocalCluster:
    """Start workers that ignore a terminal's SIGINT: only the command handles it."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # processes inherit it
    try:
        with dask.config.set(QUIET):
            return LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                host='127.0.0.1',
                dashboard_address='127.0.0.1:0',
                memory_limit=0,
                silence_logs=logging.CRITICAL,
            )
    finally:
        signal.signal(signal.SIGINT, before)


def _join(scheduler: str) -> Client:
    try:
        place = urlsplit(scheduler)
        if place.scheme != 'tcp' or not place.hostname or not place.port:
            raise ValueError
        # Dask's client would wait for ever for a server that sends nothing; a scheduler
        # sends first.
        with socket.create_connection((place.hostname, place.port), CONNECT_TIMEOUT) as probe:
            if not probe.recv(1):
                raise ValueError
        return Client(scheduler, timeout=CONNECT_TIMEOUT, name='khr-sweep')
    except (OSError, ValueError) as error:
        raise SweepError(
            f'--scheduler: {scheduler!r}: no scheduler answers there; accepted: '
            'the address of a running "dask scheduler", such as '
            'tcp://127.0.0.1:8786'
        ) from error


def _result(future: Any, result: Any) -> Any:
    if future.status == 'finished':
        return result
    if future.status != 'error':
        raise RunError('the scheduler has stopped; start it and repeat the command to go on')
    error = result[1]
    if isinstance(error, KilledWorker):
        return None
    text = str(error) if isinstance(error, KhrError) else f'{type(error).__name__}: {error}'
    raise RunError(' '.join(text.split())) from error
