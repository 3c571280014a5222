"""Read mutants one after another, each within some seconds; print what fails.

python -m tests.reliability.fuzz COUNT [SEED]
"""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from khr_bringup import scenario as scenarios
from khr_experiments.experiments import shipped
from tests.reliability.mutants import mutants, try_change, try_file

LIMIT = 20  # s for a file: what is bounded takes far less, on a loaded machine too


def faults(count: int, seed: int) -> list[str]:
    """Return what went wrong with so many mutants: of scenarios, of sweeps, of changes."""
    files = {
        'scenario': [path.read_bytes() for path in scenarios.shipped()]
        + [scenarios.load('walk_9.7deg_ka12_kh13').to_yaml().encode()],
        'sweep': [path.read_bytes() for path in shipped().values()],
    }
    found = []
    with TemporaryDirectory() as folder:
        path = Path(folder) / 'mutant.yaml'
        for kind, seeds in files.items():
            for number, content in enumerate(mutants(seeds, 2 * count // 5, seed)):
                path.write_bytes(content)
                found += _named(f'{kind} {number}', _limited(lambda k=kind: try_file(path, k)))
        changes = [
            b'ankle_controller.gain=12',
            b'simulator.push_point=[0, 0, 0.1]',
            b'gait.motion=walk',
        ]
        for number, content in enumerate(mutants(changes, count // 5, seed)):
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
