"""Functions that Numba compiles; each keeps its plain-Python twin as ``py_func``.

The compiler is not allowed to reorder or fuse floating-point operations, so both give the same
numbers, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any


@cache
def compiled(function: Callable[..., Any]) -> Any:
    """Return a function that is compiled when first called, and kept for later processes.

    The compiler takes a third of a second to import, which nothing but a simulation needs.
    """
    import numba

    try:
        return numba.njit(cache=True)(function)
    except RuntimeError:  # there is no folder that it could be kept in
        return numba.njit(function)
