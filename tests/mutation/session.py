"""One core module under mutation: Cosmic Ray changes it in a copy of the sources, one mutant a run.

The session is a database beside the copy. It is named after the module's text and that of its
tests, so that an interrupted session goes on, and a changed module or test begins another.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkItem, WorkResult

ROOT = Path(__file__).resolve().parents[2]
WORK = ROOT / 'build' / 'mutants'
COPIED = ('src', 'config', 'tests', 'pyproject.toml', 'examples', 'docs', 'README.md')
TIMEOUT = 180.0  # s; a mutant whose tests take longer hangs, and is killed
# With postponed annotations "X | None" is text: a change of it changes nothing.
EQUIVALENT = 'ReplaceBinaryOperator_BitOr_'


@dataclass(frozen=True)
class Mutant:
    """One change of a module, and whether a test failed: None if it was not tried.

    Attributes:
        line: of the module.
        change: the lines taken out and put in, as a diff has them.
        killed: whether some test failed.
    """

    line: int
    change: str
    killed: bool | None


class Session:
    """The mutants of one module.

    Args:
        module: dotted name, such as ``khr_sim.servo``.
        most: how many mutants to try, drawn at random, always the same; all if there are fewer.

    Raises:
        ValueError: if there is no such module, or no unit test imports it.
    """

    def __init__(self, module: str, most: int) -> None:
        self.module, self._most = module, most
        package, *inner = module.split('.')
        self._path = Path('src', package, package, *inner).with_suffix('.py')
        if not inner or not (ROOT / self._path).is_file():
            raise ValueError(f'{module}: no such module; accepted: one like khr_sim.servo')
        self.tests = tests_of(module)
        if not self.tests:
            raise ValueError(f'{module}: no unit test of its package imports it')
        texts = [(ROOT / path).read_bytes() for path in (self._path, *self.tests)]
        digest = hashlib.sha256(b'\0'.join(texts)).hexdigest()[:12]
        self._database = WORK / f'{module}-{most}-{digest}.sqlite'

    def run(self) -> None:
        """Try the mutants that are left, in a fresh copy of the sources."""
        copy = WORK / 'tree'
        _refresh(copy)
        configuration = WORK / f'{self.module}.toml'
        configuration.write_text(self._configuration(), encoding='utf-8')
        if not self._database.exists():
            draft = self._database.with_suffix('.draft')
            draft.unlink(missing_ok=True)
            _call(copy, 'init', configuration, draft)
            with use_db(str(draft), WorkDB.Mode.open) as found:
                _draw(found, self._most)
            draft.rename(self._database)
        _call(copy, 'exec', configuration, self._database)

    def mutants(self) -> list[Mutant]:
        """Return the mutants in the order of the lines."""
        if not self._database.exists():
            return []
        with use_db(str(self._database), WorkDB.Mode.open) as found:
            results = dict(found.results)
            items = list(found.work_items)
        drawn = [item for item in items if not _skipped(results.get(item.job_id))]
        return sorted(
            (_mutant(item, results.get(item.job_id)) for item in drawn),
            key=lambda mutant: mutant.line,
        )

    def _configuration(self) -> str:
        command = ' '.join(
            (sys.executable, '-m pytest -x -q -n 0 -p no:cacheprovider', *map(str, self.tests))
        )
        return (
            f'[cosmic-ray]\nmodule-path = "{self._path}"\ntimeout = {TIMEOUT}\n'
            f'excluded-modules = []\ntest-command = "{command}"\n\n'
            '[cosmic-ray.distributor]\nname = "local"\n'
        )


def tests_of(module: str) -> tuple[Path, ...]:
    """Return the unit tests of its own package that import a module."""
    imports = (f'from {module} import', f'import {module}')
    return tuple(
        path.relative_to(ROOT)
        for path in sorted((ROOT / 'tests' / 'unit' / module.split('.')[0]).rglob('test_*.py'))
        if any(text in path.read_text(encoding='utf-8') for text in imports)
    )


def _refresh(copy: Path) -> None:
    """Copy the sources, over what an interrupted session may have left changed."""
    shutil.rmtree(copy, ignore_errors=True)
    copy.mkdir(parents=True)
    for name in COPIED:
        there = ROOT / name
        if there.is_dir():
            unwanted = shutil.ignore_patterns('__pycache__', 'build', '*.egg-info')
            shutil.copytree(there, copy / name, ignore=unwanted)
        else:
            shutil.copy(there, copy / name)


def _call(copy: Path, verb: str, configuration: Path, database: Path) -> None:
    sources = sorted(str(path) for path in (copy / 'src').glob('khr_*'))
    environment = os.environ | {
        'PYTHONPATH': os.pathsep.join(sources),  # before what is installed
        'PYTHONDONTWRITEBYTECODE': '1',  # two mutants of one second and length are not the same
        'ROS_PYTHON_CHECK_FIELDS': '1',
    }
    subprocess.run(
        [Path(sys.executable).with_name('cosmic-ray'), verb, configuration, database],
        cwd=copy,
        env=environment,
        check=True,
    )


def _draw(found: WorkDB, most: int) -> None:
    """Skip mutants that change nothing, and of the others all but some drawn at random."""
    items = sorted(found.work_items, key=lambda item: (_where(item), item.mutations[0].occurrence))
    useful = [item for item in items if not _is_equivalent(item)]
    drawn = set(random.Random(0).sample([item.job_id for item in useful], min(most, len(useful))))
    for item in items:
        if item.job_id not in drawn:
            found.set_result(item.job_id, WorkResult(WorkerOutcome.SKIPPED))


def _where(item: WorkItem) -> tuple[int, int, str]:
    mutation = item.mutations[0]
    return (*mutation.start_pos, mutation.operator_name)


def _is_equivalent(item: WorkItem) -> bool:
    return EQUIVALENT in item.mutations[0].operator_name


def _skipped(result: WorkResult | None) -> bool:
    return result is not None and result.worker_outcome is WorkerOutcome.SKIPPED


def _mutant(item: WorkItem, result: WorkResult | None) -> Mutant:
    line = item.mutations[0].start_pos[0]
    if result is None or result.diff is None:
        return Mutant(line, '', None)
    changed = [
        text.rstrip()
        for text in result.diff.splitlines()
        if text[:1] in '-+' and text[:3] not in ('---', '+++')
    ]
    return Mutant(line, '\n'.join(changed), result.test_outcome is not TestOutcome.SURVIVED)
