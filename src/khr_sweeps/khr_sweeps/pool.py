"""Compute on processes of this machine, over pipes: nothing listens, so nobody can connect."""

from __future__ import annotations

import itertools
import os
import pickle
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import Pipe
from pathlib import Path
from queue import Empty, PriorityQueue, SimpleQueue
from subprocess import DEVNULL, Popen
from threading import Lock, Thread
from typing import Any, Protocol, TypeVar

from khr_common import KhrError, RunError
from khr_common.lifeline import tied_to_parent
from khr_sweeps.errors import SweepError

MOST_WORKERS = 256
ATTEMPTS = 3  # workers that may be lost over one job
AHEAD, LEAST_AHEAD = 4, 64  # jobs submitted ahead: per worker, and for workers that join later
# The computations are small: threads of the linear algebra would only take cores from each other.
SINGLE_THREADED = {'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1', 'MKL_NUM_THREADS': '1'}

Task = TypeVar('Task')
Result = TypeVar('Result')


class LostWorkerError(RunError):
    """A job whose workers ended again and again."""


class Pool(Protocol):
    """Workers, on this machine or on others."""

    @property
    def workers(self) -> int:
        """Return how many there are."""

    def submit(
        self, function: Callable[..., Any], /, *arguments: Any, first: bool = False
    ) -> Future[Any]:
        """Start a job; return its future.

        Args:
            function: importable by the workers.
            arguments: of the function.
            first: whether the job is done before those that were submitted without it.
        """


@contextmanager
def local_pool(
    workers: int | None, option: str = '--workers', quiet: bool = False
) -> Iterator[Pool]:
    """Keep worker processes on this machine; end them, and what they still do, at the end.

    Args:
        workers: how many; one per core by default.
        option: what the number is called in an error.
        quiet: whether what they print is dropped.

    Raises:
        SweepError: if the number is not accepted.
    """
    pool = LocalPool(check_workers(workers, option), quiet)
    try:
        yield pool
    finally:
        pool.close()


def check_workers(workers: int | None, option: str = '--workers') -> int:
    """Return a number of workers; None is one for each core that this process may use.

    Raises:
        SweepError: if it is not accepted.
    """
    if workers is not None and not 1 <= workers <= MOST_WORKERS:
        raise SweepError(
            f'{option}: {workers} is not accepted; accepted: integer in [1, {MOST_WORKERS}]'
        )
    return workers or min(len(os.sched_getaffinity(0)), MOST_WORKERS)


def compute(
    pool: Pool, function: Callable[[Task], Result], tasks: Iterable[tuple[str, Task]]
) -> Iterator[list[tuple[str, Result | None]]]:
    """Apply a function to tasks on a pool; yield results in batches as they finish.

    Only a window of the tasks is submitted at a time.

    Args:
        pool: computes.
        function: importable by the workers.
        tasks: each with a key.

    Yields:
        Keys with results; None for a task whose workers died repeatedly.

    Raises:
        RunError: if the function raised, or the pool ended.
    """
    remaining = iter(tasks)
    finished: SimpleQueue[Future[Result]] = SimpleQueue()
    keys: dict[Future[Result], str] = {}

    def submit(count: int) -> int:
        some = list(itertools.islice(remaining, count))
        for key, task in some:
            future = pool.submit(function, task)
            keys[future] = key
            future.add_done_callback(finished.put)
        return len(some)

    waiting = submit(max(LEAST_AHEAD, AHEAD * pool.workers))
    while waiting:
        batch = [finished.get(), *_at_hand(finished)]
        waiting += submit(len(batch)) - len(batch)
        yield [(keys.pop(future), _result(future)) for future in batch]


class LocalPool:
    """Worker processes of this machine; see :func:`local_pool`.

    Each is started with its first job. A worker that ends is replaced, and its job done again.
    """

    def __init__(self, workers: int, quiet: bool = False) -> None:
        self.workers = workers
        self._quiet = quiet
        self._jobs: PriorityQueue[_Job] = PriorityQueue()
        self._numbers = itertools.count()
        self._running: set[_Worker] = set()
        self._lock = Lock()
        self._closed = False
        self._threads = [Thread(target=self._serve, daemon=True) for _ in range(workers)]
        for thread in self._threads:
            thread.start()

    def submit(
        self, function: Callable[..., Any], /, *arguments: Any, first: bool = False
    ) -> Future[Any]:
        """Start a job; return its future. See :class:`Pool`."""
        job = _Job((not first, next(self._numbers)), pickle.dumps((function, arguments)))
        self._jobs.put(job)
        return job.future

    def close(self) -> None:
        """End the workers and whatever they do, and cancel what was not begun."""
        with self._lock:
            self._closed = True
            for worker in self._running:
                worker.end()
        for _ in self._threads:
            self._jobs.put(_Job((False, -1), b''))  # wakes a thread
        for thread in self._threads:
            thread.join()
        for job in _at_hand(self._jobs):
            job.future.cancel()

    def _serve(self) -> None:
        """Hand jobs to one worker after the other, until the pool is closed."""
        worker: _Worker | None = None
        while not self._closed:
            job = self._jobs.get()
            if not job.data or not job.future.set_running_or_notify_cancel():
                continue
            try:
                for _ in range(ATTEMPTS):
                    worker = worker or self._start()
                    answer = worker.compute(job.data)
                    if answer is not None:
                        break
                    self._discard(worker)
                    worker = None
                if answer is None:
                    raise LostWorkerError(f'lost {ATTEMPTS} workers over one job')
                succeeded, found = answer
                if succeeded:
                    job.future.set_result(found)
                else:
                    job.future.set_exception(found)
            except Exception as error:  # no worker lasts, or an answer does not read
                job.future.set_exception(error)
        if worker is not None:
            self._discard(worker)

    def _start(self) -> _Worker:
        with self._lock:
            if self._closed:
                raise LostWorkerError('the computation was ended')
            try:
                worker = _Worker(self._quiet)
            except OSError as error:
                raise RunError(f'no worker process can be started: {error.strerror}') from error
            self._running.add(worker)
            return worker

    def _discard(self, worker: _Worker) -> None:
        worker.end()
        with self._lock:
            self._running.discard(worker)
        worker.wait()


@dataclass(frozen=True, order=True)
class _Job:
    """A pickled function with its arguments; those with the least place are done first."""

    place: tuple[bool, int]
    data: bytes = field(compare=False)
    future: Future[Any] = field(default_factory=Future, compare=False)


class _Worker:
    """A process that computes one job after the other (:mod:`khr_sweeps.worker`).

    Its thread starts it and serves it until its end.
    """

    def __init__(self, quiet: bool) -> None:
        tasks, self._tasks = Pipe(duplex=False)
        self._answers, answers = Pipe(duplex=False)
        with tasks, answers:  # the worker's ends, or neither side would see the other's end
            ends = tasks.fileno(), answers.fileno()
            self._process = start_worker('khr_sweeps.worker', ends, quiet)

    def compute(self, data: bytes) -> tuple[bool, Any] | None:
        """Return whether the job succeeded, with result or error; None if the worker ended."""
        try:
            self._tasks.send_bytes(data)
            answer = self._answers.recv_bytes()
        except (OSError, EOFError):
            return None
        succeeded, result = pickle.loads(answer)
        return succeeded, result

    def end(self) -> None:
        """Kill the process: it holds nothing but the job at hand, and may have been stopped."""
        self._process.kill()

    def wait(self) -> None:
        self._process.wait()
        self._tasks.close()
        self._answers.close()


def start_worker(module: str, ends: Sequence[int], quiet: bool = False) -> Popen[bytes]:
    """Start a module as a process that computes for this one, and is killed with this thread.

    It has a process group of its own, so that Ctrl-C reaches the command alone.

    Args:
        module: is given the files' numbers as its arguments.
        ends: files that it is to have: its ends of pipes.
        quiet: whether its errors are dropped.

    Raises:
        OSError: if it cannot be started.
    """
    same_modules = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
    return Popen(
        [sys.executable, '-P', '-m', module, *map(str, ends)],
        pass_fds=ends,
        stdin=DEVNULL,
        stderr=DEVNULL if quiet else None,
        process_group=0,
        env=SINGLE_THREADED | os.environ | {'PYTHONPATH': same_modules},
        preexec_fn=tied_to_parent(),
    )


def _at_hand(queue: Any) -> Iterator[Any]:
    """Yield what a queue holds now."""
    while True:
        try:
            yield queue.get_nowait()
        except Empty:
            return


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
