"""Files and runs that went wrong on their way, and harms that tests of their own do."""

import os
import sys

from tests.reliability.harms.harmed_run import command

TESTED = (
    *('reliability/test_traffic', 'reliability/test_closed'),
    *('reliability/test_other_user', 'reliability/test_workers_elsewhere'),
    *('integration/test_sweep_cluster', 'graph/test_board', 'unit/khr_hardware/test_client'),
    *('unit/khr_hardware/test_driver', 'unit/khr_hardware/test_server'),
)


def mutated(case, _):
    """Read mutated files, or hand damaged runs to commands."""
    program = (sys.executable, '-m', 'tests.reliability.mutated')
    count = {'files': 500, 'runs': 50}[case.victim]
    ended = command(*program, case.victim, count, case.number)
    return ended.stdout.splitlines() or ([ended.stderr[-300:]] if ended.returncode else [])


def tested(case, _):
    """Run the tests of a file that does harm of its own; all must pass, at once, none left out."""
    without = ('-p', 'no:cacheprovider', '-p', 'no:rerunfailures')
    ended = command(
        *(sys.executable, '-m', 'pytest', '-q', '-rs', *without, case.victim),
        env={**os.environ, 'ROS_PYTHON_CHECK_FIELDS': '1'},
    )
    lines = ended.stdout.splitlines()
    faults = [line for line in lines if line.startswith(('FAILED', 'ERROR', 'SKIPPED', 'E  '))]
    if ended.returncode != 0 and not faults:
        faults = [f'exit {ended.returncode}: {(ended.stdout + ended.stderr)[-300:]}']
    return faults


# By kind: what does the harm, and the cases.
HARMS = {
    'mutated files, 500 each': (mutated, [('', 'files', '', number) for number in range(20)]),
    'damaged runs, 50 each': (mutated, [('', 'runs', '', number) for number in range(6)]),
    'tests of traffic, users, network, workers, board': (
        tested,
        [('', f'tests/{name}.py') for name in TESTED],
    ),
}
