"""Time the gyro's two levels: ``python tests/benchmarks/bench_gyro_circuit.py``."""

import math
import statistics
import time
from collections.abc import Callable

import numpy as np

from khr_sim.sensors.gyro_circuit.baseband import Baseband
from khr_sim.sensors.gyro_circuit.carrier import simulate

DURATION = 2.0  # s of signal
SAMPLES = 50_000
REPEATS = 5


def median_time(work: Callable[[], object]) -> float:
    """Return the median of the processor times of ``REPEATS`` runs, s."""

    def once() -> float:
        start = time.process_time()
        work()
        return time.process_time() - start

    return statistics.median(once() for _ in range(REPEATS))


def wave(instants: np.ndarray) -> np.ndarray:
    """A rate of 5 rad/s at 5 Hz."""
    return 5.0 * np.sin(math.tau * 5.0 * instants)


def report() -> str:
    """Measure, and return a table."""
    steps = simulate(wave, DURATION).time.size
    full = median_time(lambda: simulate(wave, DURATION))
    baseband = Baseband(0.015)

    def run_baseband() -> None:
        for _ in range(SAMPLES):
            baseband.update(0.1)

    quick = median_time(run_baseband)
    figures = {
        'carrier_steps': steps,
        'carrier_steps_per_second': round(steps / full),
        'seconds_per_2_s_of_signal': round(full, 3),
        'microseconds_per_baseband_sample': round(1e6 * quick / SAMPLES, 2),
    }
    return '\n'.join(f'{name:<36}{value:>14,}' for name, value in figures.items())


if __name__ == '__main__':
    print(report())
