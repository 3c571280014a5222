"""Measure, keep the results in docs/performance.json, and write docs/performance.md from them.

``make bench``, or ``python -m tests.benchmarks [PART ...]``; without a part that is measured,
``--render`` writes the page again. Times on a shared machine are noisy: every round runs every
case, and only the ratios within a round are compared.
"""

import argparse
import json

from khr_common.files import write_text
from tests import ROOT
from tests.benchmarks import board, commands, environments, graphs
from tests.benchmarks.clock import log
from tests.benchmarks.page import page

DATA, PAGE = ROOT / 'docs' / 'performance.json', ROOT / 'docs' / 'performance.md'
ENGINES = ('bullet', 'mujoco')
ROUNDS = {  # measured in several rounds
    'graphs': graphs.measure,
    'graphs_mujoco': lambda: graphs.measure(graphs.MUJOCO_CASES),
    'swept': commands.sweeps,
    'environments': environments.measure,
}
ONCE = {
    'board': board.measure,
    'period': graphs.periods,
    'growth': lambda: {engine: commands.growth(engine) for engine in ENGINES},
    'commands': commands.commands,
}


def main():
    """Measure the parts that the command line names, all by default."""
    parser = argparse.ArgumentParser(prog='python -m tests.benchmarks', description=__doc__)
    parts = [*ROUNDS, *ONCE]
    parser.add_argument('parts', nargs='*', metavar='PART', help=f'accepted: {", ".join(parts)}')
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--render', action='store_true', help='write the page, measure nothing')
    given = parser.parse_args()
    for part in set(given.parts) - set(parts):
        parser.error(f'{part} is not accepted; accepted: {", ".join(parts)}')
    found = json.loads(DATA.read_text(encoding='utf-8'))
    for part in [] if given.render else given.parts or parts:
        log(part)
        found[part] = (
            [ROUNDS[part]() for _ in range(given.rounds)] if part in ROUNDS else ONCE[part]()
        )
        write_text(DATA, json.dumps(found, indent=1) + '\n')  # kept if a later part fails
    write_text(PAGE, page(found))


if __name__ == '__main__':
    main()
