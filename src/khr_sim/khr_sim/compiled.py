"""Functions that are compiled, each in plain Python as well.

The compiler is not allowed to reorder or fuse floating-point operations, so both give the same
numbers, bit for bit.

Numba takes 0.6 s to import and to load what it has compiled before, half of the start of a run. So
what it makes of the servos' law for LLVM is kept beside it, as text, which LLVM alone turns into
machine code in a tenth of that. Where the law is another than the one it was made of, Numba
compiles it.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ENTRY = 'entry'  # the name of the function in the text


@cache
def compiled(function: Callable[..., Any]) -> Any:
    """Return a function as Numba compiles it when it is first called, kept for later processes."""
    import numba

    try:
        return numba.njit(cache=True)(function)
    except RuntimeError:  # there is no folder that it could be kept in
        return numba.njit(function)


def bound(function: Callable[[Array, Array], None], first: Array, second: Array) -> partial[None]:
    """Return a function of two arrays as machine code that acts on these two, which stay in place.

    Args:
        function: of a module beside which its text may be kept, under its name.
        first, second: C-contiguous.
    """
    shapes = first.shape, second.shape
    return partial(_machine_code(function, shapes), first.ctypes.data, second.ctypes.data)


def keep(function: Callable[[Array, Array], None], *shapes: tuple[int, ...]) -> None:
    """Write beside its module what Numba makes of a function of arrays of these two shapes."""
    _place(function).write_text(_intermediate(function, shapes))


@cache
def _machine_code(function: Callable[..., None], shapes: tuple[tuple[int, ...], ...]) -> Any:
    """Return what takes the addresses of two arrays of these shapes."""
    import llvmlite.binding as llvm

    kept, made_of = _place(function), _heading(function, shapes)
    text = kept.read_text() if kept.is_file() else ''
    if not text.startswith(made_of):
        text = _intermediate(function, shapes)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), _machine())
    engine.finalize_object()
    call = ctypes.PYFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)  # it is too short to let go
    code: Any = call(engine.get_function_address(ENTRY))
    code.engine = engine  # which holds the code
    return code


def _intermediate(function: Callable[..., None], shapes: tuple[tuple[int, ...], ...]) -> str:
    """Return what Numba makes of a function for LLVM, as a function of two addresses alone."""
    import llvmlite.binding as llvm
    from numba import carray, cfunc, njit, types

    step, (first_shape, second_shape) = njit(error_model='numpy')(function), shapes

    def entry(first: Any, second: Any) -> None:
        step(carray(first, first_shape), carray(second, second_shape))

    address = types.CPointer(types.float64)
    made = cfunc(types.void(address, address), error_model='numpy')(entry)
    module = llvm.parse_assembly(made.inspect_llvm())
    module.triple = module.data_layout = ''  # for whatever processor
    for each in (*module.functions, *module.global_variables):
        if each.name == made.native_name:
            each.name = ENTRY
        elif not each.is_declaration:
            each.linkage = 'internal'
    # What is not the entry is parts of it, or never called: it raises nothing.
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    passes = llvm.create_pass_builder(_machine(), options)
    passes.getModulePassManager().run(module, passes)
    return _heading(function, shapes) + str(module)


def _machine() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.Target.from_default_triple().create_target_machine(opt=3)


def _place(function: Callable[..., None]) -> Path:
    return Path(inspect.getfile(function)).with_suffix(f'.{function.__name__}.ll')


def _heading(function: Callable[..., None], shapes: tuple[tuple[int, ...], ...]) -> str:
    own = function.__globals__
    constants = {name: own[name] for name in function.__code__.co_names if name in own}
    made_of = f'{inspect.getsource(function)}{constants}{shapes}'
    digest = sha256(made_of.encode()).hexdigest()
    return f'; {function.__module__}.{function.__name__} {digest}\n'
