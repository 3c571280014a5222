"""Mutation tests of core modules: ``python -m tests.mutation MODULE ...``, or ``make mutants``.

Each module is changed in a copy of the sources, one small change at a time, and the unit tests of
its package that import it are run. A mutant that survives is a change that no test notices: a test
that is missing, or a change that makes no difference. What is interrupted goes on.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from khr_common.files import write_text
from tests.mutation.page import page
from tests.mutation.session import Session

MODULES = (
    'khr_sim.servo',
    'khr_sim.sensors.gyro',
    'khr_balance.ankle',
    'khr_studies.peak_origin.cycle_spectrum',
    'khr_models.standing.tipping',
)


def main() -> None:
    """Try the mutants of the modules and write the page."""
    parser = argparse.ArgumentParser(prog='python -m tests.mutation', description=__doc__)
    parser.add_argument('modules', nargs='*', default=MODULES, help='such as khr_sim.servo')
    parser.add_argument('--most', type=int, default=30, help='mutants of a module (30)')
    parser.add_argument('--write', type=Path, help='the page, docs/mutants.md')
    parser.add_argument('--read', action='store_true', help='only write what was found before')
    options = parser.parse_args()
    try:
        sessions = [Session(module, options.most) for module in options.modules]
    except ValueError as error:
        sys.exit(f'tests.mutation: {error}')
    if not options.read:
        for session in sessions:
            session.run()
    text = page({session.module: session.mutants() for session in sessions}, options.most)
    print(text)
    if options.write:
        write_text(options.write, text)


if __name__ == '__main__':
    main()
