"""Results as JSON that keeps their types: data only, which no file can make run code."""

from __future__ import annotations

import json
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

PACKAGES = 'khr_'  # whose dataclasses are read back
NUMBERS = 'fiub'  # kinds of arrays, as NumPy calls them


def dumps(value: Any) -> str:
    """Write plain values, tuples, lists, mappings, arrays of numbers, dataclasses of this project.

    Raises:
        TypeError: if the value holds anything else.
    """
    return json.dumps([_plain(value)])  # in a list, so that no part of a file reads as a whole


def loads(text: str) -> Any:
    """Read what :func:`dumps` wrote.

    Raises:
        ValueError: if it did not.
    """
    try:
        (value,) = json.loads(text)
        return _revived(value)
    except (TypeError, KeyError, AttributeError, ImportError, RecursionError) as error:
        raise ValueError(f'no results: {error}') from error


def _plain(value: Any) -> Any:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list):
        return [_plain(each) for each in value]
    if isinstance(value, np.ndarray) and value.dtype.kind in NUMBERS:
        return {'array': value.tolist(), 'dtype': value.dtype.str}
    if isinstance(value, dict):
        return {'items': [[_plain(key), _plain(each)] for key, each in value.items()]}
    if isinstance(value, tuple) and type(value) is tuple:
        return {'tuple': [_plain(each) for each in value]}
    if (
        is_dataclass(value)
        and not isinstance(value, type)
        and type(value).__module__.startswith(PACKAGES)
    ):
        kind = type(value)
        return {
            'kind': [kind.__module__, kind.__qualname__],
            'fields': {each.name: _plain(getattr(value, each.name)) for each in fields(value)},
        }
    raise TypeError(f'{type(value).__name__} is not accepted; accepted: plain data')


def _revived(value: Any) -> Any:
    if isinstance(value, list):
        return [_revived(each) for each in value]
    if not isinstance(value, dict):
        return value
    if 'array' in value:
        dtype = np.dtype(value['dtype'])
        if dtype.kind not in NUMBERS:
            raise ValueError(f'{dtype} is not accepted; accepted: numbers')
        return np.array(value['array'], dtype=dtype)
    if 'items' in value:
        return {_revived(key): _revived(each) for key, each in value['items']}
    if 'tuple' in value:
        return tuple(_revived(each) for each in value['tuple'])
    return _dataclass(*value['kind'])(
        **{name: _revived(each) for name, each in value['fields'].items()}
    )


def _dataclass(module: str, name: str) -> Any:
    if not module.startswith(PACKAGES):
        raise ValueError(f'{module} is not accepted; accepted: a package of this project')
    kind = getattr(import_module(module), name)
    if not (isinstance(kind, type) and is_dataclass(kind)):
        raise ValueError(f'{name} is not accepted; accepted: a dataclass')
    return kind
