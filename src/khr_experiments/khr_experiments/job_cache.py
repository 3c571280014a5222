"""Keep the results of jobs on the disk, so that an interrupted computation can go on."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any, Protocol, get_type_hints

from pydantic import TypeAdapter

from khr_common.files import write_text
from khr_sweeps.progress import Bar


class Pool(Protocol):
    """A pool of processes, or the client of a cluster."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Any:
        """Start a job; return its future."""


class KeptJobs:
    """A pool that computes each job once for one version of the code.

    Args:
        pool: computes missing results; its workers have access to the folder.
        folder: has a file per finished job, named after the job.
        version: of the code that determines the results.
        bar: advances with each job.
        costs: number of runs of a job by function, for the bar; 1 for others.

    The functions annotate what they return, which decides how a result is read.
    """

    def __init__(
        self,
        pool: Pool,
        folder: Path,
        version: str,
        bar: Bar,
        costs: dict[Callable[..., Any], int],
    ) -> None:
        self._pool = pool
        self._folder = folder.absolute()  # workers may have another working directory
        self._version = version
        self._bar = bar
        self._costs = costs
        folder.mkdir(parents=True, exist_ok=True)

    def submit(self, function: Callable[..., Any], /, *arguments: Any) -> Any:
        """Start a job unless its result exists; return its future."""
        path = self._folder / f'{_name(self._version, function, arguments)}.json'
        try:
            done: Future[Any] = Future()
            (value,) = json.loads(path.read_text(encoding='utf-8'))
            done.set_result(_results_of(function).validate_python(value))
            return done
        except (OSError, ValueError):
            pass  # no result yet
        cost = self._costs.get(function, 1)
        self._bar.expect(cost)
        future = self._pool.submit(compute_and_keep, path, function, *arguments)
        future.add_done_callback(lambda _: self._bar.advance(cost))
        return future


def compute_and_keep(path: Path, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function without its output on stderr; keep its result in a file and return it."""
    with redirect_stderr(io.StringIO()):
        result = function(*arguments)
    value = _results_of(function).dump_python(result, mode='json')
    write_text(path, json.dumps([value]))  # in a list, so that no part of a file reads as a whole
    return result


def _results_of(function: Callable[..., Any]) -> TypeAdapter[Any]:
    return TypeAdapter(get_type_hints(function)['return'])


def _name(version: str, function: Callable[..., Any], arguments: tuple[Any, ...]) -> str:
    text = f'{version} {function.__module__}.{function.__qualname__}{arguments!r}'
    return hashlib.sha256(text.encode()).hexdigest()[:32]
