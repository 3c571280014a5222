"""A pool of processes that keeps the results of finished jobs: an interrupted study resumes.

A result is kept while the version of the code that determines it stays the same.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Any

from khr_bringup.code_version import code_version
from khr_sweeps.pool import local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.results.kept_jobs import KeptJobs

CONFIGURATION = 'khr_bringup', 'config/**/*.*'  # a job names scenarios, bouts and robots in it


@cache
def version_of_study(module: str) -> str:
    """Return a digest of the code of the runs, and of a module with all that it imports.

    Stored results are reused while it stays the same.
    """
    digest = hashlib.sha256(code_version(CONFIGURATION).encode())
    for name, source in sorted(imported_by(module).items()):
        digest.update(name.encode() + b'\0' + code_of(source))
    return digest.hexdigest()[:16]


def code_of(source: bytes, imports: bool = True) -> bytes:
    """Return the code of a module without comments, docstrings and layout.

    Without its imports, it stays the same when a name moves to another module.
    """
    tree = ast.parse(source)
    if not imports:
        tree.body = [
            node for node in tree.body if not isinstance(node, ast.Import | ast.ImportFrom)
        ]
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = node.body[1:] if ast.get_docstring(node) else node.body
    return ast.unparse(tree).encode()


def imported_by(*modules: str) -> dict[str, bytes]:
    """Return the sources of modules, and of khr modules that they import by ``from``, by name."""
    found: dict[str, bytes] = {}
    pending = [*modules]
    while pending:
        name = pending.pop()
        path = _file_of(name)
        if name in found or path is None:
            continue
        found[name] = path.read_bytes()
        for node in ast.walk(ast.parse(found[name])):
            if isinstance(node, ast.ImportFrom) and (node.module or '').startswith('khr'):
                names = (f'{node.module}.{each.name}' for each in node.names)
                pending += [str(node.module), *names]
    return found


def _file_of(name: str) -> Path | None:
    """Return the file of a module, without importing it; None for a name inside a module."""
    package, *parts = name.split('.')
    place = Path(str(files(package))).joinpath(*parts)
    options = place.with_suffix('.py'), place / '__init__.py'
    return next((path for path in options if path.is_file()), None)


@contextmanager
def kept_pool(
    study: str,
    title: str,
    workers: int | None,
    folder: Path,
    quiet: bool = False,
    runs: int = 0,
    costs: Mapping[Callable[..., Any], int] = MappingProxyType({}),
) -> Iterator[KeptJobs]:
    """Yield a pool on this machine that keeps the results of a study's jobs.

    Args:
        study: module that imports all that its jobs call.
        title: of the progress bar.
        runs: number of all runs, if it is known beforehand.
        costs: number of runs of a job by function; 1 for others.
    """
    with (
        local_pool(workers, '--workers') as pool,
        ProgressBar(title, runs, lines=True, quiet=quiet, final=runs > 0) as bar,
        KeptJobs(pool, folder, version_of_study(study), bar, dict(costs)) as kept,
    ):
        yield kept
