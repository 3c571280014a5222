"""Functions that Numba compiles; each keeps its plain-Python twin as ``py_func``.

The compiler is not allowed to reorder or fuse floating-point operations, so both give the same
numbers, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function when it is first called, and keep the result for later processes."""
    try:
        return numba.njit(cache=True)(function)
    except RuntimeError:  # there is no folder that it could be kept in
        return numba.njit(function)
