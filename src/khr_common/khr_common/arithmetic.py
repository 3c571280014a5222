"""Portable arithmetic: the same bits on every x86-64 processor.

Three libraries choose their code by the processor, with other rounding: the C library's sin, exp
and the like (fused multiply-add), NumPy's array functions, and the linear algebra below NumPy and
SciPy. Each reads settings from its environment when it is loaded, so the environment has to be set
before Python starts.

Our entry points (``khr``, the nodes) restart themselves once in that environment, which their
processes inherit. A script, a notebook or a worker of one's own is started by
``python -m khr_common.arithmetic SCRIPT ...`` or ``python -m khr_common.arithmetic -m MODULE ...``;
without, it computes as the processor does, and the first run warns. In a colcon workspace
``setup.bash`` has the settings. ``KHR_ARITHMETIC=native`` keeps the processor's own arithmetic.
"""

from __future__ import annotations

import os
import sys
from functools import cache

CHOICE, NATIVE, PORTABLE = 'KHR_ARITHMETIC', 'native', 'portable'
TUNABLES, NO_FMA = 'GLIBC_TUNABLES', 'glibc.cpu.hwcaps=-FMA,-FMA4'
SETTINGS = {
    TUNABLES: NO_FMA,
    'OPENBLAS_CORETYPE': 'Nehalem',
    'OPENBLAS_NUM_THREADS': '1',  # several add up in another order
    # Each NumPy knows some of these names: the first line those from 2.4 on.
    'NPY_DISABLE_CPU_FEATURES': 'X86_V3,X86_V4,AVX512_ICL,AVX512_SPR,'
    'AVX2,FMA3,AVX512F,AVX512CD,AVX512_SKX,AVX512_CLX,AVX512_CNL',
}
_ENTERED = 'KHR_ARITHMETIC_ENTERED'  # the process that has restarted itself
_DIGEST = 'bfa7aae1'  # of the sample computations of :func:`in_force`
# Where the C library's functions round otherwise with fused multiply-add, about once in 1500:
# sin and asin, cos, exp, arctan, arctan2, power, as multiples of the step.
_PLACES, _STEP = (847, 17528, 2989, 423, 935, 930, 300), 0.000137


def enter() -> None:
    """Restart this program in the portable environment, unless it has it already.

    It does so once: where Python itself sets a variable at its start (``sitecustomize``), another
    restart would not help. :func:`warning` tells whether the arithmetic differs.
    """
    process = str(os.getpid())  # which a restart keeps and a child does not
    again = os.environ.pop(_ENTERED, '') == process
    missing = _missing()
    if not missing or again or os.environ.get(CHOICE) == NATIVE:
        return
    os.environ.update(missing | {_ENTERED: process})
    if sys.executable and sys.orig_argv:
        os.execv(sys.executable, sys.orig_argv)


@cache
def in_force() -> str:
    """Return ``portable``, or ``native`` with a digest of the sample computations.

    The environment is not trusted: the samples differ wherever the arithmetic does.
    """
    import hashlib
    import math
    import struct

    import numpy as np

    places = [0.01 + _STEP * place for place in _PLACES]
    numbers = [f(x) for f in (math.sin, math.cos, math.atan) for x in places]
    numbers += [f(x / 30.0) for f in (math.asin, math.acos) for x in places]
    numbers += [y for x in places for y in (math.exp(-x), x**1.7, math.atan2(x, 1.3 + x * x))]
    digested = hashlib.sha256(struct.pack(f'<{len(numbers)}d', *numbers))
    many = np.arange(0.1, 50.0, 0.37)
    square = many[:121].reshape(11, 11)
    for array in (
        np.exp(-many),
        np.power(many, 1.7),
        np.arctan2(many, many[::-1]),
        square @ square,
    ):
        digested.update(array.astype('<f8').tobytes())
    digest = digested.hexdigest()[:8]
    return PORTABLE if digest == _DIGEST else f'{NATIVE} {digest}'


def warning() -> str:
    """Return a warning about an arithmetic that is not portable; empty if it is."""
    found = in_force()
    if found == PORTABLE:
        return ''
    why = (
        f'{CHOICE} asks for it'
        if os.environ.get(CHOICE) == NATIVE
        else f'start it by: python -m {__name__} SCRIPT'
    )
    return f'arithmetic is {found}: another processor takes another trajectory ({why})'


def warn_unless_portable() -> None:
    """Warn, once, of an arithmetic that is not portable."""
    if text := warning():
        import warnings

        warnings.warn(text, stacklevel=1)


def _missing() -> dict[str, str]:
    """Return the settings to change; other glibc tunables are kept.

    A value that was set before is overridden: some machines come with a BLAS kernel chosen for
    their processor. ``KHR_ARITHMETIC=native`` keeps it.
    """
    missing = {name: text for name, text in SETTINGS.items() if os.environ.get(name) != text}
    tunables = os.environ.get(TUNABLES, '').split(':')
    if NO_FMA in tunables:
        missing.pop(TUNABLES, None)
    else:
        missing[TUNABLES] = ':'.join(filter(None, [*tunables, NO_FMA]))
    return missing


if __name__ == '__main__':
    if os.environ.get(CHOICE) != NATIVE:
        os.environ.update(_missing())
    os.execv(sys.executable, [sys.executable, *sys.argv[1:]])
