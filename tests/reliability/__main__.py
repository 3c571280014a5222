"""The campaign of faults: ``make chaos``. Seeded; what is done is not repeated.

python -m tests.reliability [--seed N] [--kills N] [--soak S] [--journal FILE] [--out FILE]
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections import Counter, defaultdict
from pathlib import Path

from khr_bringup.code_version import code_version
from khr_common.files import write_text
from khr_common.markdown import table
from tests.reliability.cases import HARMS, NO_OTHER_MACHINE, attempt, cases

TITLE = '# Reliability\n\nWhat a run withstands, as `make chaos` tries it.'


def main() -> int:
    """Do what is left of a campaign, write its table; return 1 if anything fell short."""
    parser = argparse.ArgumentParser(prog='python -m tests.reliability', description=__doc__)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--kills', type=int, default=200, help='processes killed')
    parser.add_argument('--soak', type=int, default=3600, help='simulated s of each long run')
    parser.add_argument('--only', default='', help='kinds that begin so')
    parser.add_argument('--journal', type=Path, default=Path('runs/chaos.jsonl'))
    parser.add_argument('--out', type=Path, default=Path('docs/reliability.md'))
    given = parser.parse_args()
    wanted = [
        case
        for case in cases(given.seed, given.kills, given.soak)
        if case.kind.startswith(given.only)
    ]
    done = _done(given.journal)
    given.journal.parent.mkdir(parents=True, exist_ok=True)
    for number, case in enumerate(wanted, 1):
        if case.name in done:
            continue
        faults = attempt(case)
        done[case.name] = {'kind': case.kind, 'faults': faults, 'load': os.getloadavg()[0]}
        with given.journal.open('a', encoding='utf-8') as journal:
            record = {'name': case.name, 'version': code_version(), **done[case.name]}
            journal.write(json.dumps(record) + '\n')
        print(f'{number}/{len(wanted)} {case.name}: {"; ".join(faults) or "good"}', flush=True)
    results = {case.name: done[case.name] for case in wanted}
    write_text(given.out, page(results, given.seed))
    return int(any(result['faults'] for result in results.values()))


def _done(journal: Path) -> dict[str, dict]:
    """Return what a journal of this version of the code holds, by case."""
    if not journal.is_file():
        return {}
    records = [json.loads(line) for line in journal.read_text(encoding='utf-8').splitlines()]
    return {each['name']: each for each in records if each['version'] == code_version()}


def page(results: dict[str, dict], seed: int) -> str:
    """Return the table of a campaign as Markdown, and all that fell short."""
    tried, bad, faults = Counter(), Counter(), defaultdict(list)
    for name, result in results.items():
        tried[result['kind']] += 1
        bad[result['kind']] += bool(result['faults'])
        faults[result['kind']] += [f'- {name}: {fault}' for fault in result['faults']]
    rows = [(kind, str(tried[kind]), str(bad[kind])) for kind in HARMS if tried[kind]]
    loads = sorted(result['load'] for result in results.values())
    lines = [
        TITLE,
        f'Seed {seed}, code version {code_version()}, load of the machine {loads[0]:.1f} to '
        f'{loads[-1]:.1f}, median {loads[len(loads) // 2]:.1f}.',
        table(('harm', 'tried', 'fell short'), rows),
        *(['The network was not tried: ' + NO_OTHER_MACHINE] if NO_OTHER_MACHINE else []),
        *('\n'.join(found) for found in faults.values() if found),
    ]
    return '\n\n'.join(lines) + '\n'


if __name__ == '__main__':
    sys.exit(main())
