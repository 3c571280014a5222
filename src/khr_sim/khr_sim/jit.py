"""Compile functions with Numba, so that they give the same numbers as in plain Python.

Numba keeps IEEE 754 semantics by default: it neither reorders nor fuses floating-point operations.
The golden hashes rely on that, so no function may use ``fastmath``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any


@cache
def jit(function: Callable[..., Any]) -> Any:
    """Return the function as a Numba dispatcher, which compiles it on the first call.

    Later processes load the machine code from Numba's cache: ``NUMBA_CACHE_DIR``, ``__pycache__``
    beside the module or, if the installation is read-only, the cache folder of the user. Without a
    writable folder every process compiles the function again.
    """
    import numba  # takes 0.2 s, which modules that only read servo constants should not pay

    try:
        return numba.njit(cache=True)(function)
    except RuntimeError:  # no writable cache folder
        return numba.njit(function)
