"""Time the models of the thesis and the gyro's circuit: ``python -m tests.benchmarks.models``."""

import math
import time
from statistics import median
from timeit import timeit

import numpy as np

from khr_common.published import GAIT_FREQUENCY
from khr_models.gyro_circuit.baseband import Baseband
from khr_models.gyro_circuit.carrier import simulate as simulate_carrier
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
from khr_models.standing.push import ForcePulse, PushLoop, largest_push, simulate_push
from khr_models.thesis import GAINS, PEAKS, identified_servo

ROBOT, TIME = Pendulum(), np.linspace(0.0, 5.0, 5001)
LEANS = np.linspace(-0.05, 0.05, 1000)
TONES = [Tone(0.05, order * GAIT_FREQUENCY) for order in (1, 2, 3)]
BOARD_GAINS = [gain_of_board(setting) for setting in GAINS]
PUSHED, BASEBAND = PushLoop(gain=gain_of_board(12.0)), Baseband(0.015)


def reacting(_time, lean, rate):
    """Return a torque of the foot, as of a PD controller."""
    return 400.0 * lean + 30.0 * rate


def wave(time):
    """Return an angular rate of 5 rad/s at 5 Hz."""
    return 5.0 * np.sin(math.tau * 5.0 * time)


# By name: the function, and its limit in ms if it has one.
CASES = {
    'phi_cr curve, 1,000 points': (lambda: critical_inclination(ROBOT, LEANS, 'published'), 50),
    'pendulum (3.6), 5 s, published': (
        lambda: simulate(ROBOT, initial_lean=0.05, inclination=0.1, form='published'), 50),
    'pendulum (3.6), 5 s, physical, foot reacting': (
        lambda: simulate(ROBOT, initial_lean=0.01, inclination=0.05, difference=reacting), 50),
    'servo (3.11), 5 s': (lambda: simulate_servo(ROBOT, Pid(), target=-0.05, inclination=0.1), 50),
    'sliding foot, 5 s, sliding': (
        lambda: simulate_sliding(ROBOT, SlidingFoot(), Pid(), inclination=math.radians(11.0)), 50),
    'three tones (5.22), 5 s, residues': (
        lambda: response_by_residues(identified_servo().loop(0.07), TONES, TIME), None),
    'three tones (5.22), 5 s, integrated': (
        lambda: response_by_simulation(identified_servo().loop(0.07), TONES, TIME), None),
    'identification with 4,000 samples': (lambda: identify(BOARD_GAINS, PEAKS), None),
    'harmonics by series': (lambda: series_harmonics(ROBOT, 0.05, 0.15), None),
    'harmonics by integration': (lambda: integrated_harmonics(ROBOT, 0.05, 0.15), None),
    'push, 3 s': (lambda: simulate_push(PUSHED, ForcePulse(2.5, 0.1)), None),
    'largest push': (lambda: largest_push(PUSHED), None),
    'gyro, 2 s of the carrier': (lambda: simulate_carrier(wave, 2.0), None),
    'gyro, 1,000 baseband samples': (lambda: [BASEBAND.update(0.1) for _ in range(1000)], None),
}  # fmt: skip


def main(repeats=15):
    """Print median and largest computing time of each case beside its limit, ms."""
    print(f'{"case":48s}{"median ms":>11s}{"largest ms":>12s}{"limit ms":>10s}')
    for name, (run, limit) in CASES.items():
        run()  # warms up
        times = [1e3 * timeit(run, number=1, timer=time.process_time) for _ in range(repeats)]
        print(f'{name:48s}{median(times):11.2f}{max(times):12.2f}{limit or "":>10}')


if __name__ == '__main__':
    main()
