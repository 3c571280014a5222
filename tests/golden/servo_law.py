"""Renew the servos' law as it is kept compiled: ``python -m tests.golden.servo_law``."""

import os

from khr_sim.compiled import keep
from khr_sim.servo import CONSTANTS, SHAPE, law


def main() -> None:
    """Write it for whatever processor."""
    os.environ |= {'NUMBA_CPU_NAME': 'generic', 'NUMBA_CPU_FEATURES': ''}  # Numba comes after it
    keep(law, SHAPE, CONSTANTS)


if __name__ == '__main__':
    main()
