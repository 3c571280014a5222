"""The campaign of faults: ``make chaos``. Finished cases of the same sources are not repeated.

python -m tests.reliability [--only NAME] [--jobs N] [--out FOLDER]

Freed memory is overwritten (``MALLOC_PERTURB_``), so that use after free shows.
"""

import argparse
import json
import os
import random
import sys
from functools import cache
from hashlib import sha256
from multiprocessing import Pool
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp
from traceback import extract_tb
from typing import NamedTuple

import psutil
import pytest

from khr_bringup.graph.run_registry import running
from khr_common.files import write_text
from khr_common.markdown import table
from tests import ROOT
from tests.reliability.harms import files, load, machine, processes, studies
from tests.reliability.harms.harmed_run import FIGURES, Case
from tests.reliability.strangers.other_machine import why_not
from tests.support.process_signals import hand_on_signals

HARMS = {**processes.HARMS, **machine.HARMS, **files.HARMS, **studies.HARMS, **load.HARMS}
CASES = [Case(kind, *each) for kind, (_, tries) in HARMS.items() for each in tries]
random.Random(0).shuffle(CASES)
BUSY = (0, 2)  # busy loops beside a case, in turn
LOADED = 1.0  # cores that others use, from which on a machine counts as loaded
LOOK = 1.0  # s of wall time over which their use is measured
LONGEST_LINE = 600
FREED = {'MALLOC_PERTURB_': '165'}  # of the C library: any byte but 0
TITLE = (
    '# Reliability\n\nWhat a run withstands, as `make chaos` tries it, with an allocator that overwrites '
    'what is freed.'
)


@cache
def source_version():
    """Return a digest of all sources: unlike a trajectory's version, of nodes and harms as well."""
    digest, harms = sha256(), (ROOT / 'tests' / 'reliability').glob('**/*.py')
    for path in sorted([*(ROOT / 'src').glob('khr*/khr*/**/*.py'), *harms]):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b'\0' + path.read_bytes())
    return digest.hexdigest()[:16]


class Result(NamedTuple):
    """The result of a case: its faults, and how many cores other processes used."""

    name: str
    kind: str
    faults: list[str]
    others: float
    version: str
    figures: str = ''

    @property
    def loaded(self):
        """Whether it was tried on a loaded machine."""
        return self.others >= LOADED


def main():
    """Do what is left of a campaign, write its table; return 1 if anything fell short."""
    parser = argparse.ArgumentParser(prog='python -m tests.reliability', description=__doc__)
    parser.add_argument('--only', default='', help='cases whose names begin so')
    parser.add_argument(
        '--jobs', type=int, default=1, help='cases at a time, each the load of others'
    )
    parser.add_argument(
        '--out', type=Path, default=Path('docs'), help='folder of page and journal'
    )
    given = parser.parse_args()
    hand_on_signals()
    os.environ.update(FREED)
    wanted = [case for case in CASES if case.name.startswith(given.only)]
    journal, done = given.out / 'reliability.jsonl', {}
    for line in journal.read_text(encoding='utf-8').splitlines() if journal.is_file() else []:
        result = Result(**json.loads(line))
        if result.version == source_version():
            done[result.name] = result

    def write():
        write_text(journal, ''.join(json.dumps(each._asdict()) + '\n' for each in done.values()))
        results = [done[case.name] for case in wanted if case.name in done]
        write_text(given.out / 'reliability.md', page(results, len(wanted)))
        return results

    left = [case for case in wanted if case.name not in done]
    loads = [case for case in left if case.kind in load.HARMS]
    others = [case for case in left if case.kind not in load.HARMS]
    for jobs, cases in ((given.jobs, others), (1, loads)):
        with (
            TemporaryDirectory(prefix='khr-chaos-') as folder,
            Pool(jobs, _own_register, [folder]) as pool,
        ):
            beside = BUSY if jobs == 1 and cases is others else (0,)
            tasks = [(case, beside[n % len(beside)]) for n, case in enumerate(cases)]
            for result in pool.imap_unordered(attempt, tasks):
                done[result.name] = result
                said = '; '.join(result.faults) or 'good'
                print(f'{result.name} (others {result.others:.1f}): {said}', flush=True)
                write()
    return int(any(result.faults for result in write()))


def _own_register(folder):
    """Give the runs of a job a register of their own."""
    os.environ['XDG_RUNTIME_DIR'] = mkdtemp(dir=folder)


def attempt(task):
    """Do a case beside so many busy loops, in a folder of its own."""
    (case, loops), figures = task, ''
    with (
        TemporaryDirectory(prefix='khr-chaos-', ignore_cleanup_errors=True) as folder,
        load.busy(loops),
    ):
        others = psutil.cpu_percent(LOOK) / 100.0 * (psutil.cpu_count() or 1)
        measured = Path(folder, FIGURES)
        try:
            faults = HARMS[case.kind][0](case, Path(folder))
            figures = measured.read_text() if measured.is_file() else ''
        except (Exception, pytest.fail.Exception) as error:  # a fault too, to be looked into
            at = extract_tb(error.__traceback__)[-1]
            faults = [f'campaign: {at.name}, line {at.lineno}: {type(error).__name__}: {error}']
    dead = [each.scenario for each in running() if not psutil.pid_exists(each.pid)]
    faults = [*faults, *(f'left an entry of {name}' for name in dead)]
    faults = [' '.join(fault.split())[:LONGEST_LINE] for fault in faults]
    return Result(case.name, case.kind, faults, round(others, 2), source_version(), figures)


def page(results, count):
    """Return the table of a campaign of so many cases as Markdown, and all that fell short."""
    quiet, loaded = ([r for r in results if r.loaded == which] for which in (False, True))
    rows, alone, said = [], why_not(), []
    for name, some in (('quiet', quiet), ('loaded', loaded)):
        if used := sorted(each.others for each in some):
            median = used[len(used) // 2]
            said.append(f'{name}: {used[0]:.1f} to {used[-1]:.1f}, median {median:.1f}')
    for kind in HARMS:
        tried = [[each for each in some if each.kind == kind] for some in (quiet, loaded)]
        counts = [(len(some), sum(bool(each.faults) for each in some)) for some in tried]
        if any(tried):
            rows.append((kind, *(str(number) for pair in counts for number in pair)))
    short = [f'- {each.name}: {fault}' for each in results for fault in each.faults]
    measured = [
        f'- {each.kind}, {"loaded" if each.loaded else "quiet"}: {each.figures}'
        for each in results
        if each.figures
    ]
    lines = [
        TITLE,
        f'{len(results)} of {count} cases, each in [reliability.jsonl](reliability.jsonl). Version '
        f'{source_version()} of sources and harms. A machine is loaded if other processes used {LOADED:g} core '
        f'or more of it just before; cores that others used: {"; ".join(said)}.',
        table(('harm', 'tried, quiet', 'fell short', 'tried, loaded', 'fell short'), rows),
        f'The network was not tried: {alone}' if alone else '',
        '\n'.join(short),
        '\n'.join(['Measured:\n', *measured] if measured else []),
    ]
    return '\n\n'.join(filter(None, lines)) + '\n'


if __name__ == '__main__':
    sys.exit(main())
