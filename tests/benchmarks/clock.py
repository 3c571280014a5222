"""Clocks, and lines of progress, of the benchmarks."""

from __future__ import annotations

import sys
import time

Numbers = dict[str, float]
FACTORS = WALL, COMPUTING = 'factor', 'by computing time'


def clocks() -> tuple[float, float]:
    """Return wall time and the time that this thread has computed, s."""
    return time.perf_counter(), time.thread_time()


def factors(simulated: float, began: tuple[float, float]) -> Numbers:
    """Return simulated time by wall time and by computing time since ``began``."""
    wall, computed = (now - then for now, then in zip(clocks(), began, strict=True))
    return {WALL: simulated / wall, COMPUTING: simulated / computed}


def log(text: str) -> None:
    """Print a line with the time on standard error."""
    print(f'{time.strftime("%X")} {text}', file=sys.stderr, flush=True)
