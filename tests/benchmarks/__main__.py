"""Run all benchmarks: ``python -m tests.benchmarks``, or ``make bench``.

Times on a shared machine are noisy. Every round runs every case, and the ratios within a round
are what counts.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from khr_common.files import write_text
from tests.benchmarks import (
    bench_board,
    bench_commands,
    bench_environment,
    bench_graph,
    bench_growth,
    bench_gyro_circuit,
    bench_messages,
    bench_models,
    bench_period,
    bench_sweeps,
    performance_page,
)
from tests.benchmarks.clock import log

KEPT = Path('build') / 'benchmarks.json'  # where there is no page to write
PARTS = ('graphs', 'messages', 'board', 'period', 'swept', 'environments', 'growth', 'commands')


def main() -> None:
    """Measure, print the page, and write it with its data if asked to."""
    parser = argparse.ArgumentParser(prog='python -m tests.benchmarks', description=__doc__)
    parser.add_argument('--repeats', type=int, default=3, help='rounds of all cases')
    parser.add_argument('--growth', type=float, default=3600.0, help='simulated s of standing')
    parser.add_argument('--write', type=Path, help='page; its JSON lies beside it')
    parser.add_argument(
        '--only', nargs='+', choices=PARTS, default=PARTS, metavar='PART',
        help=f'of {", ".join(PARTS)}; the others are those of --read',
    )  # fmt: skip
    parser.add_argument(
        '--read', type=Path, help='JSON of an earlier page; without --only, nothing is measured'
    )
    options = parser.parse_args()
    found = _checked(parser, options)
    data = options.write.with_suffix('.json') if options.write else KEPT
    parts = options.only if options.only != PARTS or not options.read else ()
    for number, part in enumerate(parts, 1):
        left = ', '.join(parts[number:]) or 'nothing'
        log(f'part {number} of {len(parts)}: {part}; then {left}')
        found[part] = _measured(part, options)
        data.parent.mkdir(exist_ok=True)
        write_text(data, json.dumps(found, indent=1) + '\n')  # whatever happens to the others
        log(f'{part} is kept in {data}')
    text = performance_page.page(**found)
    print(text)
    if options.write:
        write_text(options.write, text)
        write_text(data, json.dumps(found, indent=1) + '\n')


def _checked(parser: argparse.ArgumentParser, options: argparse.Namespace) -> dict[str, Any]:
    """Refuse what is not accepted before anything runs; return what an earlier page measured."""
    if options.repeats < 1:
        parser.error(f'--repeats: {options.repeats} is not accepted; accepted: 1 or more')
    if not 0.0 < options.growth < float('inf'):
        parser.error(f'--growth: {options.growth:g} is not accepted; accepted: s above 0')
    if options.write and not options.write.parent.is_dir():
        parser.error(f'--write: {options.write.parent} is no folder; accepted: a file in one')
    try:
        found = json.loads(options.read.read_text(encoding='utf-8')) if options.read else {}
        performance_page.page(**found)
    except (OSError, ValueError, TypeError, KeyError) as error:
        parser.error(f'--read: {options.read}: {error}; accepted: what --write has written')
    return found


def _measured(part: str, options: argparse.Namespace) -> Any:
    if part == 'graphs':
        print('## Models\n', bench_models.report(), sep='\n')
        print('\n## Gyro circuit\n', bench_gyro_circuit.report(), '', sep='\n')
        return bench_graph.measure(options.repeats)
    if part == 'messages':
        return [bench_messages.measure() for _ in range(options.repeats)]
    if part == 'board':
        return bench_board.measure(1)
    if part == 'period':
        return {engine: bench_period.measure(engine) for engine in ('bullet', 'mujoco')}
    if part == 'swept':
        return [bench_sweeps.measure() for _ in range(options.repeats)]
    if part == 'environments':
        return [bench_environment.measure() for _ in range(options.repeats)]
    if part == 'growth':
        return {
            engine: bench_growth.measure(engine, options.growth) for engine in ('bullet', 'mujoco')
        }
    return bench_commands.measure()


if __name__ == '__main__':
    main()
