"""Time the models: ``python -m tests.benchmarks.bench_models``."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable

import numpy as np

from khr_common.published import GAIT_FREQUENCY
from khr_models.harmonics import integrated_harmonics, series_harmonics
from khr_models.pendulum import Pendulum, critical_inclination, simulate
from khr_models.servo.identification import identify
from khr_models.servo.servo_loop import (
    Tone,
    gain_of_board,
    response_by_residues,
    response_by_simulation,
)
from khr_models.standing.ankle_servo import Pid, simulate_servo
from khr_models.standing.friction import SlidingFoot, simulate_sliding
from khr_models.standing.push import largest_push, simulate_push
from khr_models.standing.tipping import ForcePulse, PushLoop
from khr_models.thesis import GAINS, PEAKS, identified_servo

REPEATS = 15
ROBOT, TIME = Pendulum(), np.linspace(0.0, 5.0, 5001)
LEANS = np.linspace(-0.05, 0.05, 1000)
TONES = [Tone(0.05, order * GAIT_FREQUENCY) for order in (1, 2, 3)]
GAINS_S = [gain_of_board(setting) for setting in GAINS]
PUSHED = PushLoop(gain=gain_of_board(12.0))

CASES: dict[str, tuple[Callable[[], object], float | None]] = {  # what, and its limit in ms
    'phi_cr curve, 1,000 points': (lambda: critical_inclination(ROBOT, LEANS, 'published'), 50.0),
    'pendulum (3.6), 5 s, published': (
        lambda: simulate(ROBOT, initial_lean=0.05, inclination=0.1, form='published'),
        50.0,
    ),
    'pendulum (3.6), 5 s, physical, foot reacting': (
        lambda: simulate(
            ROBOT,
            initial_lean=0.01,
            inclination=0.05,
            difference=lambda _t, lean, rate: 400.0 * lean + 30.0 * rate,
        ),
        50.0,
    ),
    'servo (3.11), 5 s': (
        lambda: simulate_servo(ROBOT, Pid(), target=-0.05, inclination=0.1),
        50.0,
    ),
    'sliding foot, 5 s, sliding': (
        lambda: simulate_sliding(ROBOT, SlidingFoot(), Pid(), inclination=math.radians(11.0)),
        50.0,
    ),
    'three tones (5.22), 5 s, residues': (
        lambda: response_by_residues(identified_servo().loop(0.07), TONES, TIME),
        None,
    ),
    'three tones (5.22), 5 s, integrated': (
        lambda: response_by_simulation(identified_servo().loop(0.07), TONES, TIME),
        None,
    ),
    'identification with 4,000 samples': (lambda: identify(GAINS_S, PEAKS), None),
    'harmonics by series': (lambda: series_harmonics(ROBOT, 0.05, 0.15), None),
    'harmonics by integration': (lambda: integrated_harmonics(ROBOT, 0.05, 0.15), None),
    'push, 3 s': (lambda: simulate_push(PUSHED, ForcePulse(2.5, 0.1)), None),
    'largest push': (lambda: largest_push(PUSHED), None),
}


def measure() -> list[dict[str, float | str | None]]:
    """Return name, median and largest processor time of each case, ms, after a run to warm up."""
    results: list[dict[str, float | str | None]] = []
    for name, (run, limit) in CASES.items():
        run()
        times = []
        for _ in range(REPEATS):
            start = time.process_time()
            run()
            times.append(1e3 * (time.process_time() - start))
        results.append(
            {
                'case': name,
                'median_ms': statistics.median(times),
                'largest_ms': max(times),
                'limit_ms': limit,
            }
        )
    return results


def report() -> str:
    """Measure, and return a table."""
    lines = [f'{"case":48s}{"median ms":>11s}{"largest ms":>12s}{"limit ms":>10s}']
    for row in measure():
        limit = '' if row['limit_ms'] is None else f'{row["limit_ms"]:.0f}'
        lines.append(
            f'{row["case"]:48s}{row["median_ms"]:11.2f}{row["largest_ms"]:12.2f}{limit:>10s}'
        )
    return '\n'.join(lines)


if __name__ == '__main__':
    print(report())
