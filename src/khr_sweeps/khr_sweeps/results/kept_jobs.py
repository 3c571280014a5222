"""Keep the results of jobs on the disk, so that an interrupted computation can resume."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from contextlib import redirect_stderr
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from khr_sweeps.pool import Pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.store import Store

RESULTS = 'jobs.sqlite'


@dataclass(eq=False)
class KeptJobs:
    """A pool that computes each job once for one version of the code.

    The return annotation of a function determines how its result is read.
    """

    pool: Pool  # computes missing results
    folder: Path  # of the file of results; it waits while another command writes the file
    version: str  # of the code that determines the results
    bar: ProgressBar  # advances with each job
    # number of runs of a job by function, for the bar; 1 for others
    costs: dict[Callable[..., Any], int]

    def __enter__(self) -> KeptJobs:
        return self

    def __exit__(self, *error: object) -> None:
        if '_results' in self.__dict__:
            self._results.close()

    @cached_property
    def _results(self) -> Store[Any]:
        """The results; the file is opened with the first job."""
        self.folder.mkdir(parents=True, exist_ok=True)
        return Store(self.folder / RESULTS, {'results': 'jobs'}, _plain, wait=True)

    @property
    def workers(self) -> int:
        """Return the number of workers."""
        return self.pool.workers

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Future[Any]:
        """Submit a job unless its result exists; return its future."""
        name = _name(self.version, function, arguments)
        kind = TypeAdapter(get_type_hints(function)['return'])
        cost = self.costs.get(function, 1)
        if name in self._results.values:
            try:
                done: Future[Any] = Future()
                done.set_result(kind.validate_python(self._results.values[name]))
                self.bar.skip(cost)
                return done
            except ValueError:
                pass  # of another type: the job is repeated, and its result replaced
        self.bar.expect(cost)
        kept: Future[Any] = Future()

        def keep(computed: Future[Any]) -> None:
            self.bar.advance(cost)
            try:
                result = computed.result()
                value = kind.dump_python(result, mode='json')
                self._results.add({name: value})
                kept.set_result(result)
            except (Exception, CancelledError) as error:
                kept.set_exception(error)

        computed = self.pool.submit(compute_quietly, function, *arguments)
        computed.add_done_callback(keep)
        return kept


def compute_quietly(function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function without its output on stderr."""
    with redirect_stderr(io.StringIO()):
        return function(*arguments)


def _plain(value: Any) -> Any:
    return value


def _name(version: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> str:
    text = f'{version} {function.__module__}.{function.__qualname__}{arguments!r}'
    return hashlib.sha256(text.encode()).hexdigest()[:32]
