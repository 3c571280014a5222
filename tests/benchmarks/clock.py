"""Clocks and progress lines of the benchmarks."""

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


def log(text):
    """Print a line with the time on standard error."""
    print(f'{time.strftime("%X")} {text}', file=sys.stderr, flush=True)
