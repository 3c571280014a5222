"""Typed results as JSON files; None stands for a missing number."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from khr_common.errors import LONGEST, KhrError
from khr_common.files import write_text

Result = TypeVar('Result')


def write_json(path: Path, result: Any) -> None:
    """Write a dataclass, or a list of such, as JSON; make the folder if needed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, TypeAdapter(type(result)).dump_json(result, indent=1).decode() + '\n')


def read_json(path: Path, kind: type[Result], name: str = '') -> Result:
    """Read what :func:`write_json` wrote; messages have a name such as ``an ensemble``."""
    try:
        return TypeAdapter(kind).validate_json(path.read_bytes())
    except OSError as error:
        raise KhrError(f'{path}: {error.strerror}; accepted: a file that khr wrote') from error
    except ValidationError as error:
        first = error.errors()[0]
        where = '.'.join(map(str, first['loc']))
        raise KhrError(
            f'{path}: not {name or f"a {kind.__name__.lower()}"} of this version '
            f'({": ".join(filter(None, (where, first["msg"][:LONGEST])))}); '
            'accepted: a file that khr wrote'
        ) from error
