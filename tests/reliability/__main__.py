"""The campaign of faults: ``make chaos``. Seeded; what is done is not repeated.

python -m tests.reliability [--seed N] [--kills N] [--soak S] [--busy N ...] [--jobs N]
[--journal FILE] [--out FILE]

What a run frees is overwritten (``MALLOC_PERTURB_``), so that whoever uses it afterwards is seen.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import psutil

from khr_common.files import write_text
from khr_common.markdown import table
from tests import ROOT
from tests.reliability.cases import HARMS, attempt, cases
from tests.reliability.harms import load
from tests.reliability.harms.harmed_run import Case
from tests.reliability.strangers.other_machine import why_not
from tests.support.process_signals import hand_on_signals

LOADED = 1.0  # cores that others use, from which on a machine counts as loaded
LOOK = 1.0  # s of wall time over which their use is measured
FREED = {'MALLOC_PERTURB_': '165'}  # of the C library: any byte but 0
TITLE = (
    '# Reliability\n\nWhat a run withstands, as `make chaos` tries it, with an allocator that overwrites '
    'what is freed.'
)


@cache
def source_version() -> str:
    """Return a digest of all sources: unlike a trajectory's version, of nodes and harms as well."""
    digest, harms = sha256(), (ROOT / 'tests' / 'reliability').glob('**/*.py')
    for path in sorted([*(ROOT / 'src').glob('khr*/khr*/**/*.py'), *harms]):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b'\0' + path.read_bytes())
    return digest.hexdigest()[:16]


class Result(NamedTuple):
    """What came of a case: what fell short, beside how many cores that others used."""

    name: str
    kind: str
    faults: list[str]
    others: float
    version: str
    figures: str = ''

    @property
    def loaded(self) -> bool:
        """Return whether it was tried on a loaded machine."""
        return self.others >= LOADED


def main() -> int:
    """Do what is left of a campaign, write its table; return 1 if anything fell short."""
    parser = argparse.ArgumentParser(prog='python -m tests.reliability', description=__doc__)
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--kills', type=int, default=300, help='processes killed')
    parser.add_argument('--soak', type=int, default=3600, help='simulated s of each long run')
    parser.add_argument('--only', default='', help='kinds that begin so')
    parser.add_argument(
        '--busy', type=int, nargs='+', default=[0, 2], help='busy loops beside a case, in turn'
    )
    parser.add_argument(
        '--jobs', type=int, default=1, help='cases at a time, each the load of others'
    )
    parser.add_argument('--share', type=int, help=argparse.SUPPRESS)  # one job's cases
    parser.add_argument('--journal', type=Path, default=Path('docs/reliability.jsonl'))
    parser.add_argument('--out', type=Path, default=Path('docs/reliability.md'))
    given = parser.parse_args()
    hand_on_signals()
    os.environ.update(FREED)
    found = cases(given.seed, given.kills, given.soak)
    wanted = [case for case in found if case.kind.startswith(given.only)]
    names = {case.name for case in wanted}

    def write() -> list[Result]:
        results = [each for each in _done(given.journal) if each.name in names]
        write_text(given.out, page(results, given.seed, len(names)))
        return results

    if given.share is not None:
        shared = [case for case in wanted if case.kind not in load.HARMS]
        list(_campaign(shared[given.share :: given.jobs], given.journal, [0]))
        return 0
    _drop_other_versions(given.journal)
    if given.jobs > 1:
        _share_out(given.jobs)
    for _ in _campaign(wanted, given.journal, given.busy):
        write()
    return int(any(result.faults for result in write()))


def _campaign(wanted: Sequence[Case], journal: Path, loops: Sequence[int]) -> Iterator[Result]:
    """Try the cases that a journal does not hold yet; each beside some busy loops, in turn."""
    done = {each.name for each in _done(journal)}
    journal.parent.mkdir(parents=True, exist_ok=True)
    for number, case in enumerate(wanted, 1):
        if case.name in done:
            continue
        with load.busy(0 if case.kind in load.HARMS else loops[number % len(loops)]):
            others = psutil.cpu_percent(LOOK) / 100.0 * (psutil.cpu_count() or 1)
            faults, figures = attempt(case)
        result = Result(case.name, case.kind, faults, round(others, 2), source_version(), figures)
        with journal.open('a', encoding='utf-8') as file:
            file.write(json.dumps(result._asdict()) + '\n')
        said = '; '.join(faults) or 'good'
        print(f'{number}/{len(wanted)} {case.name} (others {others:.1f}): {said}', flush=True)
        yield result


def _share_out(jobs: int) -> None:
    """Try cases in so many processes, each with a register of runs of its own; but not loads."""
    command = [sys.executable, '-m', 'tests.reliability', *sys.argv[1:]]
    with TemporaryDirectory(prefix='khr-chaos-') as folder:
        started = []
        for share in range(jobs):
            register = Path(folder) / str(share)
            register.mkdir(mode=0o700)
            environment = {**os.environ, 'XDG_RUNTIME_DIR': str(register)}
            started.append(subprocess.Popen([*command, '--share', str(share)], env=environment))
        for each in started:
            each.wait()


def _done(journal: Path) -> list[Result]:
    """Return what a journal holds of this version of the sources, the newest of each case."""
    if not journal.is_file():
        return []
    records = [json.loads(line) for line in journal.read_text(encoding='utf-8').splitlines()]
    found = [Result(**each) for each in records if each['version'] == source_version()]
    return list({each.name: each for each in found}.values())


def _drop_other_versions(journal: Path) -> None:
    """Leave in a journal what was done with these sources alone."""
    if journal.is_file():
        lines = [json.dumps(each._asdict()) + '\n' for each in _done(journal)]
        write_text(journal, ''.join(lines))


def page(results: Sequence[Result], seed: int, count: int) -> str:
    """Return the table of a campaign of so many cases as Markdown, and all that fell short."""
    rows, short, alone = [], [], why_not()
    measured = [
        f'- {each.kind}, {"loaded" if each.loaded else "quiet"}: {each.figures}'
        for each in results
        if each.figures
    ]
    for kind in HARMS:
        of_kind = [each for each in results if each.kind == kind]
        cells = []
        for loaded in (False, True):
            tried = [each for each in of_kind if each.loaded == loaded]
            bad = [each for each in tried if each.faults]
            cells += [str(len(tried)), str(len(bad))]
            short += [f'- {each.name}: {fault}' for each in bad for fault in each.faults]
        if of_kind:
            rows.append((kind, *cells))
    lines = [
        TITLE,
        f'{len(results)} of {count} cases, each in [reliability.jsonl](reliability.jsonl). Seed {seed}, version '
        f'{source_version()} of sources and harms. A machine is loaded if other processes used '
        f'{LOADED:g} core or more of it just before; {_others(results)}.',
        table(('harm', 'tried, quiet', 'fell short', 'tried, loaded', 'fell short'), rows),
        *([f'The network was not tried: {alone}'] if alone else []),
        *(['\n'.join(short)] if short else []),
        *(['Measured:', '\n'.join(measured)] if measured else []),
    ]
    return '\n\n'.join(lines) + '\n'


def _others(results: Sequence[Result]) -> str:
    """Return how many cores others used, quiet and loaded."""
    said = []
    for name, loaded in (('quiet', False), ('loaded', True)):
        used = sorted(each.others for each in results if each.loaded == loaded)
        if used:
            said.append(
                f'{name}: {used[0]:.1f} to {used[-1]:.1f}, median {used[len(used) // 2]:.1f}'
            )
    return f'cores that others used: {"; ".join(said)}'


if __name__ == '__main__':
    sys.exit(main())
