"""The optimiser of every search: CMA-ES over shares of the ranges searched."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import suppress
from math import inf
from typing import Any


def evolution(start: Sequence[float], spread: float, seed: int, population: int) -> Any:
    """Return a ``cma.CMAEvolutionStrategy`` with candidates in [0, 1].

    Args:
        start: mean of the first generation.
        spread: standard deviation of the first generation.
        seed: positive; the library takes 0 for the time of day.
        population: candidates of a generation.
    """
    with warnings.catch_warnings(), suppress(ImportError):
        warnings.simplefilter('ignore')
        import cma
    options = {'seed': seed, 'bounds': [0.0, 1.0], 'popsize': population, 'verbose': -9}
    if len(start) == 1:
        options['maxstd'] = inf  # the library raises ValueError where it limits a single one
    return cma.CMAEvolutionStrategy(list(start), spread, options)
