"""Clocks and progress lines of the benchmarks."""

import statistics
import sys
import time
from contextlib import contextmanager
from unittest.mock import patch

import numpy as np

CLOCKS = WALL, COMPUTING = 'factor', 'by computing time'


def clocks():
    """Return wall time and computing time of this thread, s."""
    return np.array([time.perf_counter(), time.thread_time()])


def speeds(simulated, spent):
    """Return simulated time over each of two times, by the names of the clocks."""
    return dict(zip(CLOCKS, (simulated / spent).tolist(), strict=True))


@contextmanager
def timed(owner, name, spent, part):
    """Add the wall time of every call of a function to ``spent[part]``, s."""
    function = getattr(owner, name)

    def call(*arguments, **options):
        began = time.perf_counter()
        try:
            return function(*arguments, **options)
        finally:
            spent[part] += time.perf_counter() - began

    with patch.object(owner, name, call):
        yield


def computing_time(function, repeats):
    """Return median and largest computing time of a function after one warm-up call, ms."""
    function()
    times = []
    for _ in range(repeats):
        began = time.process_time()
        function()
        times.append(1e3 * (time.process_time() - began))
    return statistics.median(times), max(times)


def log(text):
    """Print a line with the time on standard error."""
    print(f'{time.strftime("%X")} {text}', file=sys.stderr, flush=True)
