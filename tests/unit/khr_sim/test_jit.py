"""Functions are compiled, with or without a cache folder."""

from numba.core.caching import CacheImpl

from khr_sim.jit import jit


def scaled_sum(a, b, c):
    return a * b + c


def test_a_function_is_compiled_without_a_writable_cache_folder(monkeypatch):
    monkeypatch.setattr(CacheImpl, '_locator_classes', [])
    compiled = jit.__wrapped__(scaled_sum)
    assert compiled(2.0, 3.0, 4.0) == 10.0
    assert compiled.signatures


def test_multiplication_and_addition_are_rounded_one_by_one():
    a = 1.0 + 2.0**-30
    assert jit(scaled_sum)(a, a, -1.0 - 2.0**-29) == 0.0  # a fused operation would give 2**-60
