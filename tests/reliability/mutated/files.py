"""Read mutants one after another, each within some seconds; print what fails.

python -m tests.reliability.mutated.files COUNT [SEED]
"""

import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.reliability.mutated.mutants import mutants
from tests.reliability.mutated.readers import seeds, try_change, try_file

LIMIT = 20  # s for a file: what is bounded takes far less, on a loaded machine too


def faults(count: int, seed: int) -> list[str]:
    """Return what went wrong with so many mutants: of each kind of file, and of changes."""
    kinds, found = seeds(), []
    each = -(-count // (len(kinds) + 1))
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'mutant.yaml'
        for kind, good in kinds.items():
            for number, content in enumerate(mutants(good, each, seed)):
                path.write_bytes(content)
                found += _named(f'{kind} {number}', _limited(lambda k=kind: try_file(path, k)))
        changes = [
            b'ankle_controller.gain=12',
            b'simulator.push_point=[0, 0, 0.1]',
            b'gait.motion=walk',
        ]
        for number, content in enumerate(mutants(changes, each, seed)):
            text = content.decode('utf-8', 'surrogateescape')
            found += _named(f'change {number}', _limited(lambda t=text: try_change(t)))
    return found


def _named(what: str, fault: str) -> list[str]:
    return [f'{what}: {fault}'] if fault else []


def _limited(attempt) -> str:
    signal.alarm(LIMIT)
    try:
        return attempt()
    except TimeoutError:
        return f'took more than {LIMIT} s'
    finally:
        signal.alarm(0)


def _late(*_: object) -> None:
    raise TimeoutError


if __name__ == '__main__':
    signal.signal(signal.SIGALRM, _late)
    count, seed = int(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 0
    lines = faults(count, seed)
    print(*lines, f'{count} mutants, {len(lines)} faults', sep='\n')
    sys.exit(bool(lines))
