"""The code version of a trajectory, and the versions of its libraries."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from os import confstr
from pathlib import Path
from platform import python_version

from khr_bringup.node_registry import registry
from khr_bringup.scenario.scenario import Scenario
from khr_common.arithmetic import in_force, warn_unless_portable
from khr_sim.physics import engines
from khr_sim.run_parameters import RunParameters

# Code that decides a trajectory and its outcome: whole packages, and modules of the others.
# Nodes only carry numbers between cores: over topics or offline, the trajectory is the same.
NODES = 'nodes'
SOURCES = (
    ('khr_common', '**/*.py'),
    ('khr_description', '**/*.py'),
    ('khr_description', 'urdf/*.urdf'),
    ('khr_models', 'gyro_circuit/*.py'),
    ('khr_sim', '**/*.py'),
    ('khr_balance', '**/*.py'),
    ('khr_analysis', '*.py'),
    ('khr_bringup', 'bout/bout.py'),
    ('khr_bringup', 'bout/offline.py'),
    ('khr_bringup', 'bout/result.py'),
    ('khr_bringup', 'changes.py'),
    ('khr_bringup', 'offline.py'),
    ('khr_bringup', 'recorded/run_signals.py'),
    ('khr_bringup', 'scenario/*.py'),
)
LIBRARIES = ('numpy', 'numba')  # and the library of the engine
# These begin lines at the end of a scenario as run: of the code, and of each thing around it.
MARK, MADE_WITH = '# code version ', '# made with '


@cache
def code_version(
    *more: tuple[str, str], engine: str = '', joined: tuple[str, ...] | None = None
) -> str:
    """Return a short digest of all code that decides the result of a run.

    It changes with every change of that code, of the robot's description, of the arithmetic, NumPy,
    Numba and the physics engine; it does not depend on where the project is installed.

    Args:
        more: further code to take in, as packages with patterns of files.
        engine: the physics engine of the run; all that are installed if left out.
        joined: foreign packages with nodes in the run; by default all that are installed.
    """
    digest = hashlib.sha256()
    foreign = _foreign(registry()) if joined is None else joined
    for package, pattern in (*SOURCES, *((package, '**/*.py') for package in foreign), *more):
        for name, content in _sources(package, pattern):
            digest.update(f'{package}/{name}\n'.encode())
            digest.update(content)
    for name, text in library_versions(engine).items():
        digest.update(f'{name} {text}\n'.encode())
    return digest.hexdigest()[:16]


def _sources(package: str, pattern: str) -> Iterator[tuple[str, bytes]]:
    """Yield name and content of each file of a package that decides the result of a run."""
    try:
        folder = Path(str(files(package)))
    except TypeError:  # one module is a package's whole
        yield f'{package}.py', Path(str(import_module(package).__file__)).read_bytes()
        return
    for path in sorted(folder.glob(pattern)):
        if NODES not in path.relative_to(folder).parts:
            yield path.relative_to(folder).as_posix(), path.read_bytes()


def library_versions(engine: str = '') -> dict[str, str]:
    """Return the arithmetic and the library versions that determine a trajectory, by name."""
    wanted = [engines.LIBRARIES[engine]] if engine else engines.LIBRARIES.values()
    found = {'arithmetic': in_force(), **{library: version(library) for library in LIBRARIES}}
    for library in wanted:
        with suppress(PackageNotFoundError):  # no run can be of this engine
            found[library] = version(library)
    return found


def version_of(scenario: Scenario) -> str:
    """Return the code version of a scenario's run."""
    return code_version(
        engine=scenario.table(RunParameters).engine, joined=_foreign(scenario.nodes)
    )


def _foreign(nodes: Iterable[str]) -> tuple[str, ...]:
    """Return the foreign packages with nodes: their code affects the trajectory too."""
    joined = (registry()[node] for node in nodes)
    return tuple(sorted({node.spec.package for node in joined if not node.own}))


def versions_of_run(scenario: Scenario | None = None) -> dict[str, str]:
    """Return the versions that a scenario as run states, with Python and the C library, by name.

    Another Python or C library rarely changes the trajectory.
    """
    library, _, number = (confstr('CS_GNU_LIBC_VERSION') or 'C library').partition(' ')
    engine = scenario.table(RunParameters).engine if scenario else ''
    return {'Python': python_version(), library: number, **library_versions(engine)}


def as_run(scenario: Scenario, text: str = '') -> str:
    """Return a whole scenario as YAML, with the versions that it runs with as its last lines.

    Args:
        scenario: to run.
        text: in place of its own, such as that of a bout.
    """
    warn_unless_portable()
    lines = [f'{MADE_WITH}{name}: {text}\n' for name, text in versions_of_run(scenario).items()]
    return ''.join([text or scenario.to_yaml(), *lines, f'{MARK}{version_of(scenario)}\n'])


def versions_in(text: str) -> dict[str, str]:
    """Return the versions that a scenario as run states, by name."""
    stated = (
        line.removeprefix(MADE_WITH).partition(': ')
        for line in text.splitlines()
        if line.startswith(MADE_WITH)
    )
    return {name: value for name, _, value in stated}


def differences(text: str, here: Mapping[str, str]) -> str:
    """List the versions of a scenario as run that differ from those here; empty if all agree."""
    return ', '.join(
        f'{name} {value}, here {here[name]}'
        for name, value in versions_in(text).items()
        if name in here and here[name] != value
    )


def version_in(text: str) -> str:
    """Return the code version stated in a scenario as run; empty if it states none."""
    found = [line.removeprefix(MARK) for line in text.splitlines() if line.startswith(MARK)]
    return found[-1] if found else ''
