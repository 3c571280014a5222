"""Random numbers that depend on a seed and a name, and on nothing else."""

from __future__ import annotations

import numpy as np


def generator(seed: int, name: str) -> np.random.Generator:
    """Return the generator of a node: with the same seed, no two nodes draw alike."""
    sequence = np.random.SeedSequence(seed, spawn_key=tuple(name.encode()))
    return np.random.Generator(np.random.PCG64(sequence))
