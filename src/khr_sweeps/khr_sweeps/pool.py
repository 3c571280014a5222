"""Compute on worker processes of this machine, over pipes: nothing listens for connections."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from queue import SimpleQueue
from threading import Lock, Thread
from types import ModuleType
from typing import Any, Protocol, TypeVar

from khr_common import KhrError, RunError
from khr_common.processes import end_with

MOST_WORKERS = 256
ATTEMPTS = 3  # workers that may be lost over one job
PER_WORKER, LEAST_AHEAD = 4, 64  # jobs submitted ahead; the minimum is for workers that join later
# Jobs are small: threads of the linear algebra would only take cores from other workers.
SINGLE_THREADED = ('OMP_NUM_THREADS', 'OPENBLAS_NUM_THREADS', 'MKL_NUM_THREADS')
_starting = Lock()  # of a worker process

Call = tuple[Any, ...]  # a function with its arguments
Task = TypeVar('Task')
Result = TypeVar('Result')


class LostWorkerError(RunError):
    """Several workers were lost while they computed one job."""


class Pool(Protocol):
    """Workers, on this machine or on others."""

    @property
    def workers(self) -> int:
        """Return the number of workers."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Submit a job, a function that the workers can import; return its future."""


def check_workers(workers: int | None, option: str = '--workers') -> int:
    """Return the number of workers; None is one for each core that this process may use."""
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise KhrError.refused(option, workers, f'integer in [1, {MOST_WORKERS}]')
    return workers or min(len(os.sched_getaffinity(0)), MOST_WORKERS)


def compute(
    pool: Pool, function: Callable[[Task], Result], tasks: Iterable[tuple[str, Task]]
) -> Iterator[list[tuple[str, Result | None]]]:
    """Apply a function to tasks with keys on a pool; yield results in batches as they finish.

    The workers must be able to import the function. Only a window of the tasks is submitted at a
    time.

    Yields:
        Keys with results; None for a task over which several workers were lost.

    Raises:
        RunError: if the function raised, or the pool ended.
    """
    remaining = iter(tasks)
    keys: dict[Future[Result], str] = {}

    def submit(count: int) -> None:
        for key, task in itertools.islice(remaining, count):
            keys[pool.submit(function, task)] = key

    submit(max(LEAST_AHEAD, PER_WORKER * pool.workers))
    while keys:
        done = wait(keys, return_when=FIRST_COMPLETED).done
        submit(len(done))
        yield [(keys.pop(future), _result(future)) for future in done]


def local_pool(workers: int | None, option: str = '--workers', quiet: bool = False) -> LocalPool:
    """Return worker processes on this machine.

    Args:
        workers: their number; one per core by default.
        option: name of the number in an error.
        quiet: whether the workers' output on stderr is dropped.
    """
    return LocalPool(check_workers(workers, option), quiet)


class LocalPool:
    """Worker processes on this machine, which end with their block, also during a job.

    Each worker is an executor of its own, started with its first job: a worker that is lost breaks
    its executor, and so the job over which it was lost is known.
    """

    def __init__(self, workers: int, quiet: bool = False) -> None:
        self.workers = workers
        self._quiet = quiet
        self._jobs: SimpleQueue[tuple[Call, Future[Any]] | None] = SimpleQueue()
        self._running: set[_Worker] = set()
        self._lock = Lock()
        self._closed = False
        self._threads = [Thread(target=self._serve, daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> LocalPool:
        return self

    def __exit__(self, *error: object) -> None:
        """Kill the workers, and cancel the jobs that have not started."""
        with self._lock:
            self._closed = True
            for worker in self._running:
                worker.kill()
        for _ in self._threads:
            self._jobs.put(None)  # wakes a thread
        for thread in self._threads:
            thread.join()
        while not self._jobs.empty():
            if job := self._jobs.get():
                job[1].cancel()

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Submit a job; return its future. See :class:`Pool`."""
        future: Future[Any] = Future()
        self._jobs.put(((function, *arguments), future))
        return future

    def _serve(self) -> None:
        """Compute one job after another on a worker, until the pool is closed."""
        worker: _Worker | None = None
        while not self._closed:
            job = self._jobs.get()
            if job is None or not job[1].set_running_or_notify_cancel():
                continue
            call, future = job
            try:
                for _ in range(ATTEMPTS):
                    try:
                        worker = worker or self._start()
                        future.set_result(worker.executor.submit(_guarded, *call).result())
                        break
                    except BrokenProcessPool:
                        self._discard(worker)
                        worker = None
                else:
                    raise LostWorkerError(f'lost {ATTEMPTS} workers over one job')
            except Exception as error:
                future.set_exception(error)
        self._discard(worker)

    def _start(self) -> _Worker:
        if self._closed:
            raise LostWorkerError('the pool was closed')
        try:
            worker = _start_worker(self._quiet)
        except OSError as error:
            raise RunError(f'no worker process can be started: {error.strerror}') from error
        with self._lock:
            self._running.add(worker)
            if self._closed:
                worker.kill()
        return worker

    def _discard(self, worker: _Worker | None) -> None:
        if worker is not None:
            with self._lock:
                self._running.discard(worker)
            worker.executor.shutdown()


@dataclass(frozen=True, eq=False)
class _Worker:
    """An executor with one process."""

    executor: ProcessPoolExecutor
    pid: int

    def kill(self) -> None:
        with suppress(ProcessLookupError):
            os.kill(self.pid, signal.SIGKILL)  # a stopped process ends as well


def _start_worker(quiet: bool) -> _Worker:
    """Start a process that ends with this thread.

    It does not import the main module, which may be a script that would compute again, and ignores
    Ctrl-C, which is for the command.
    """
    executor = ProcessPoolExecutor(
        1, multiprocessing.get_context('spawn'), _initialise, (os.getpid(), quiet)
    )
    with _starting:
        resource_tracker.ensure_running()  # here, as it unblocks SIGINT
        main = sys.modules['__main__']
        sys.modules['__main__'] = ModuleType('__main__')
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        added = [name for name in SINGLE_THREADED if name not in os.environ]
        os.environ.update(dict.fromkeys(added, '1'))
        try:
            pid = executor.submit(os.getpid)
        finally:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
            sys.modules['__main__'] = main
            for name in added:  # the caller's own programs may use several
                del os.environ[name]
    return _Worker(executor, pid.result())


def _initialise(parent: int, quiet: bool) -> None:
    """Prepare a worker process."""
    end_with(parent)
    if quiet:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def _guarded(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function; replace an error that cannot be pickled by its text."""
    try:
        return function(*arguments)
    except Exception as error:
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            raise RuntimeError(f'{type(error).__name__}: {error}') from None
        raise


def _result(future: Future[Result]) -> Result | None:
    try:
        return future.result()
    except LostWorkerError:
        return None
    except CancelledError as error:
        raise RunError('the computation was ended') from error
    except RunError:
        raise
    except Exception as error:
        text = str(error) if isinstance(error, KhrError) else f'{type(error).__name__}: {error}'
        raise RunError(' '.join(text.split())) from error
