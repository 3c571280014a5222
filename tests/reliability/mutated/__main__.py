"""Read mutated files, or hand damaged runs to commands, each in some seconds; print what fails.

python -m tests.reliability.mutated files | runs COUNT [SEED]
"""

import signal
import sys

from tests.reliability.mutated import readers, runs

LIMIT = 60  # s for each: what is bounded takes far less, on a loaded machine too


def _late(*_):
    raise TimeoutError(f'took more than {LIMIT} s')


def main(what, count, seed=0):
    signal.signal(signal.SIGALRM, _late)
    attempts, fell_short = {'files': readers.attempts, 'runs': runs.attempts}[what], False
    for name, attempt in attempts(int(count), int(seed)):
        signal.alarm(LIMIT)
        fault = attempt()
        signal.alarm(0)
        if fault:
            fell_short = True
            print(f'{name}: {fault}')
    sys.exit(fell_short)


if __name__ == '__main__':
    main(*sys.argv[1:])
