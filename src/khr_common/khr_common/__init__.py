"""Shared by every khr package: parameter tables, interfaces, errors, the base of the nodes."""

from __future__ import annotations

TYPE_CHECKING = False  # that of typing, which every start of Python would import for it
if TYPE_CHECKING:
    from khr_common.errors import KhrError, RunError
    from khr_common.parameters import (
        ParameterError,
        build,
        check,
        fixed,
        parameter,
        sample_period,
        specifications,
    )

__all__ = [
    'KhrError',
    'ParameterError',
    'RunError',
    'build',
    'check',
    'fixed',
    'parameter',
    'sample_period',
    'specifications',
]
_ERRORS = ('KhrError', 'RunError')


def __getattr__(name: str) -> object:
    """Import names on first use: ``khr_common.arithmetic`` is imported before a restart."""
    if name not in __all__:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    from importlib import import_module

    home = 'khr_common.errors' if name in _ERRORS else 'khr_common.parameters'
    return getattr(import_module(home), name)
