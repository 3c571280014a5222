"""The version of the code that determines the results of a study."""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from importlib.resources import files
from pathlib import Path

from khr_bringup.code_version import code_version

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
