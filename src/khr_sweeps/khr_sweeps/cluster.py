"""Compute on the workers of a Dask scheduler, on this machine or on others."""

from __future__ import annotations

import logging
import socket
import ssl
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from khr_common import RunError
from khr_common.errors import KhrError
from khr_sweeps.pool import LostWorkerError, Pool, local_pool

CONNECT_TIMEOUT = 5.0  # s of wall time for a scheduler to answer
CREDENTIALS = 'ca.pem', 'cert.pem', 'key.pem'
STOPPED = 'the scheduler has stopped; start it and repeat the command to go on'


@dataclass(frozen=True)
class Scheduler:
    """A Dask scheduler and the protection of its connections.

    Raises:
        KhrError: if the address does not fit, or a credential is missing or open to other users.
    """

    address: str  # tls://HOST:PORT, or tcp://HOST:PORT without TLS
    tls: Path | None = None  # folder of the credentials; None without TLS
    unauthenticated: bool = False  # whether a scheduler without TLS is accepted

    def __post_init__(self) -> None:
        if self.tls is None and not self.unauthenticated:
            raise KhrError(
                f'--scheduler: {self.address!r} without --tls: whoever reaches its port runs code '
                'on every worker and here; accepted: --tls FOLDER with '
                f'{", ".join(CREDENTIALS)}, or --unauthenticated'
            )
        if self.tls is not None and self.unauthenticated:
            raise KhrError('--unauthenticated: not accepted beside --tls; accepted: one of them')
        scheme = 'tls' if self.tls else 'tcp'
        try:
            place = urlsplit(self.address)
            if place.scheme != scheme or not place.hostname or not place.port:
                raise ValueError
        except ValueError as error:
            raise KhrError.refused('--scheduler', self.address, f'{scheme}://HOST:PORT') from error
        for path in self.files:
            _check_credential(path)

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the files of the authority's certificate, the certificate and its key."""
        return tuple(self.tls / name for name in CREDENTIALS) if self.tls else ()

    @property
    def host_and_port(self) -> tuple[str, int]:
        """Return host and port."""
        place = urlsplit(self.address)
        return str(place.hostname), int(place.port or 0)


@contextmanager
def open_pool(workers: int, scheduler: Scheduler | None = None) -> Iterator[Pool]:
    """Open a pool: processes of this machine, or the workers of a scheduler.

    Args:
        workers: number of processes; ignored with a scheduler.
        scheduler: of a Dask cluster.

    Raises:
        KhrError: if the number is not accepted, or no scheduler answers.
    """
    if scheduler is None:
        with local_pool(workers) as pool:
            yield pool
        return
    import dask

    _silence()
    with (
        dask.config.set({'distributed.comm.timeouts.connect': CONNECT_TIMEOUT}),
        _connect(scheduler) as client,
    ):
        yield ClusterPool(client)


class ClusterPool:
    """The workers of a Dask client's scheduler, as a :class:`khr_sweeps.pool.Pool`."""

    def __init__(self, client: Any) -> None:
        self._client = client
        self._waiting: set[Any] = set()  # Dask drops a job without references to its future

    @property
    def workers(self) -> int:
        """Return the number of jobs that run at a time."""
        return sum(self._client.nthreads().values())

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Submit a job; return its future."""
        future: Future[Any] = Future()
        remote = self._client.submit(function, *arguments, pure=False)
        self._waiting.add(remote)

        def finish(_: Any) -> None:
            self._waiting.discard(remote)
            try:
                future.set_result(_result(remote))
            except Exception as error:
                future.set_exception(error)

        remote.add_done_callback(finish)
        return future


def _result(remote: Any) -> Any:
    from distributed import KilledWorker

    if remote.status not in ('finished', 'error'):
        raise RunError(STOPPED)
    try:
        return remote.result()
    except KilledWorker as error:
        raise LostWorkerError('lost several workers over one job') from error
    except (OSError, TimeoutError) as error:
        if remote.status == 'error':
            raise  # by the job
        raise RunError(STOPPED) from error


def _connect(scheduler: Scheduler) -> Any:
    from distributed import Client

    security = security_of(scheduler)
    try:
        _probe(scheduler, security)
        return Client(
            scheduler.address, timeout=CONNECT_TIMEOUT, name='khr-sweep', security=security
        )
    except (OSError, ValueError) as error:
        reason = ' '.join(str(error).split()) or type(error).__name__
        raise KhrError(
            f'--scheduler: {scheduler.address!r}: no scheduler answers there ({reason}); accepted: '
            'the address of a running "dask scheduler"'
            + ' with a certificate of the same authority'
            * bool(scheduler.tls)
        ) from error


def security_of(scheduler: Scheduler) -> Any:
    """Return the credentials of a scheduler for Dask; None without TLS."""
    if not scheduler.tls:
        return None
    from distributed.security import Security

    authority, certificate, key = map(str, scheduler.files)
    security = Security(
        tls_ca_file=authority,
        tls_client_cert=certificate,
        tls_client_key=key,
        require_encryption=True,
    )
    try:
        security.get_connection_args('client')
    except (OSError, ValueError) as error:  # of the TLS library
        raise KhrError(
            f'--tls: {str(scheduler.tls)!r}: not certificates with their key '
            f'({" ".join(str(error).split())}); accepted: {", ".join(CREDENTIALS)} in PEM'
        ) from error
    return security


def _probe(scheduler: Scheduler, security: Any) -> None:
    """Raise OSError unless a scheduler answers, which sends first.

    Dask's client has no timeout for a server that sends nothing.
    """
    with socket.create_connection(scheduler.host_and_port, CONNECT_TIMEOUT) as plain:
        if security is None:
            answer = plain.recv(1)
        else:
            context: ssl.SSLContext = security.get_connection_args('client')['ssl_context']
            with context.wrap_socket(plain) as protected:
                answer = protected.recv(1)
        if not answer:
            raise OSError('the connection was closed')


def _check_credential(path: Path) -> None:
    try:
        mode = path.stat().st_mode
        path.read_bytes()
    except OSError as error:
        raise KhrError(
            f'--tls: {str(path)!r}: {error.strerror}; accepted: a folder with '
            f'{", ".join(CREDENTIALS)}'
        ) from error
    if path.name == CREDENTIALS[-1] and mode & 0o077:
        raise KhrError(
            f'--tls: {str(path)!r} is open to other users (mode {mode & 0o777:o}); '
            'accepted: mode 600'
        )


def _silence() -> None:
    """Suppress the log of Dask: khr reports its errors in one line."""
    import distributed  # noqa: F401 (makes the loggers)

    for name in [*logging.root.manager.loggerDict, 'distributed']:
        if name.split('.')[0] in ('distributed', 'tornado', 'asyncio'):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
