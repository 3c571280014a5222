"""The largest push: how hard may a standing robot be pushed from behind, by ankle gain?

python examples/push_study.py [--seconds 0.4]
"""

import argparse

import khr

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument('--seconds', type=float, default=0.4, help='how long a push lasts')
seconds = parser.parse_args().seconds


def stands(gain, force):
    """Return whether the robot is still up 4 s after the push."""
    push = f't=1 duration={seconds} link=base_link frame=odom force={force},0,0 point=0,0,0.05'
    run = khr.run(
        'push_behind',
        set={
            'simulator.pushes': [push],
            'ankle_controller.enabled': gain > 0,
            'ankle_controller.gain': gain,
        },
        duration=5,
    )
    return run.outcome.stayed_up


for gain in (0.0, 12.0, 24.0):
    low, high = 0.0, 16.0  # N; it survives the first and falls from the second
    while high - low > 0.25:
        middle = (low + high) / 2
        low, high = (middle, high) if stands(gain, middle) else (low, middle)
    print(f'K_A = {gain:4g}: {(low + high) / 2:5.2f} N for {seconds:g} s')
