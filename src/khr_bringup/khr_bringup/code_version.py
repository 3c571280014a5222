"""Which version of the project a trajectory comes from."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path
from platform import python_version

from khr_bringup.node_registry import OWN, registry, spec_of
from khr_bringup.scenario import Scenario
from khr_sim import engines
from khr_sim.run_parameters import RunParameters

# What decides a trajectory and its outcome: whole packages, and single modules of the others.
# Nodes only carry numbers between cores: over topics or offline, the trajectory is the same.
NODES = 'nodes'
SOURCES = (
    ('khr_common', '**/*.py'),
    ('khr_sim', '**/*.py'),
    ('khr_sim', 'urdf/*.urdf'),
    ('khr_balance', '**/*.py'),
    ('khr_analysis', 'outcome.py'),
    ('khr_analysis', 'outcome_measures.py'),
    ('khr_bringup', 'offline.py'),
    ('khr_bringup', 'run_signals.py'),
)
LIBRARIES = ('numpy', 'numba')  # and that of the engine
# These begin lines at the end of a scenario as run: of the code, and of each library.
MARK, LIBRARY = '# code version ', '# version of '


@cache
def code_version(
    *more: tuple[str, str], engine: str = '', joined: tuple[str, ...] | None = None
) -> str:
    """Return a short digest of all code that decides what a run gives.

    It changes with every change of that code, of the robot's description, of NumPy, Numba and
    the physics engine; it does not depend on where the project is installed.

    Args:
        more: further code to take in, as packages with patterns of files.
        engine: the physics engine of the run; all that are installed if left out.
        joined: foreign packages whose nodes take part; all that are installed if left out.
    """
    digest = hashlib.sha256()
    foreign = _foreign(registry()) if joined is None else joined
    for package, pattern in (*SOURCES, *((package, '**/*.py') for package in foreign), *more):
        folder = Path(str(files(package)))
        for path in sorted(folder.glob(pattern)):
            if NODES in path.relative_to(folder).parts:
                continue
            digest.update(f'{package}/{path.relative_to(folder).as_posix()}\n'.encode())
            digest.update(path.read_bytes())
    for library, number in library_versions(engine).items():
        digest.update(f'{library} {number}\n'.encode())
    return digest.hexdigest()[:16]


def library_versions(engine: str = '') -> dict[str, str]:
    """Return the versions of the libraries that decide a trajectory, as :func:`code_version`."""
    wanted = [engines.LIBRARIES[engine]] if engine else engines.LIBRARIES.values()
    found = {library: version(library) for library in LIBRARIES}
    for library in wanted:
        try:
            found[library] = version(library)
        except PackageNotFoundError:  # no run can be of this engine
            continue
    return found


def version_of(scenario: Scenario) -> str:
    """Return the code version of a scenario's run."""
    return code_version(
        engine=scenario.table(RunParameters).engine, joined=_foreign(scenario.nodes)
    )


def _foreign(nodes: Iterable[str]) -> tuple[str, ...]:
    """Return the packages of nodes that are not this project's, whose cores decide a run too."""
    own = {*OWN, *(package for package, _ in SOURCES)}
    return tuple(sorted({spec_of(node).package for node in nodes} - own))


def as_run(scenario: Scenario) -> str:
    """Return a whole scenario as YAML, with the versions that it ran with as its last lines."""
    libraries = library_versions(scenario.table(RunParameters).engine)
    numbers = {'Python': python_version(), **libraries}
    lines = [f'{LIBRARY}{name}: {number}\n' for name, number in numbers.items()]
    return ''.join([scenario.to_yaml(), *lines, f'{MARK}{version_of(scenario)}\n'])


def libraries_in(text: str) -> dict[str, str]:
    """Return the versions of Python and the libraries stated in a scenario as run, by name."""
    stated = (
        line.removeprefix(LIBRARY).partition(': ')
        for line in text.splitlines()
        if line.startswith(LIBRARY)
    )
    return {name: number for name, _, number in stated}


def version_in(text: str) -> str:
    """Return the code version stated in a scenario as run; empty if there is none."""
    found = [line.removeprefix(MARK) for line in text.splitlines() if line.startswith(MARK)]
    return found[-1] if found else ''
