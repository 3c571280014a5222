"""Files and runs that went wrong on their way, and harms that tests of their own do."""

import os
import subprocess
import sys
from pathlib import Path

from tests import ROOT
from tests.reliability.harms.harmed_run import Case


def fuzz(case: Case, _: Path) -> list[str]:
    """Read mutated files."""
    ended = subprocess.run(
        [sys.executable, '-m', 'tests.reliability.mutated.files', '500', str(case.seed)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return [] if ended.returncode == 0 else ended.stdout.splitlines()[:-1] or [ended.stderr[-300:]]


def damage(case: Case, _: Path) -> list[str]:
    """Hand damaged runs to report, verify and film."""
    ended = subprocess.run(
        [sys.executable, '-m', 'tests.reliability.mutated.runs', '50', str(case.seed)],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    return [] if ended.returncode == 0 else ended.stdout.splitlines()[:-1] or [ended.stderr[-300:]]


def tested(case: Case, _: Path) -> list[str]:
    """Run the tests of a file that does harm of its own; all must pass, at once, none left out."""
    without = ('-p', 'no:cacheprovider', '-p', 'no:rerunfailures')
    ended = subprocess.run(
        [sys.executable, '-m', 'pytest', '-q', '-rs', *without, case.victim],
        cwd=ROOT, capture_output=True, text=True, check=False,
        env={**os.environ, 'ROS_PYTHON_CHECK_FIELDS': '1'},
    )  # fmt: skip
    lines = ended.stdout.splitlines()
    faults = [line for line in lines if line.startswith(('FAILED', 'ERROR', 'SKIPPED', 'E  '))]
    if ended.returncode != 0 and not faults:
        faults = [f'exit {ended.returncode}: {(ended.stdout + ended.stderr)[-300:]}']
    return faults


HARMS = {
    'mutated files, 500 each': fuzz,
    'damaged runs, 50 each': damage,
    'tests of traffic, users, network, workers, hangs, board': tested,
}
TESTED = (
    'reliability/test_traffic', 'reliability/test_no_hang', 'reliability/test_closed',
    'reliability/test_other_user', 'reliability/test_workers_elsewhere',
    'integration/test_sweep_cluster', 'graph/test_board', 'unit/khr_hardware/test_client',
    'unit/khr_hardware/test_driver', 'unit/khr_hardware/test_server',
)  # fmt: skip


def cases(seed: int) -> list[Case]:
    """Return the cases of these harms."""
    return [
        *(Case('mutated files, 500 each', '', '', '', seed + n) for n in range(20)),
        *(Case('damaged runs, 50 each', '', '', '', seed + n) for n in range(6)),
        *(Case('tests of traffic, users, network, workers, hangs, board', '', f'tests/{name}.py')
          for name in TESTED),
    ]  # fmt: skip
