"""The environments' names in Gymnasium: ``gymnasium.make('khr/Walk-v0')`` after ``import khr``.

Gymnasium takes longer to import than the rest of a command, so whoever does not use it does not
wait for it: the names are registered once it is imported, before or after khr.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType

# What each is about; any other scenario: gymnasium.make(ID, scenario=NAME).
ENVIRONMENTS = {'khr/Balance-v0': 'stand_0deg', 'khr/Walk-v0': 'walk_7.68deg_ka12'}
REGISTRY = 'gymnasium.envs.registration'


def register_environments() -> None:
    """Register the environments with Gymnasium, now or as soon as it is imported."""
    if REGISTRY in sys.modules:
        _register(sys.modules[REGISTRY])
    else:
        sys.meta_path.insert(0, _OnceImported())


def _register(registration: ModuleType) -> None:
    for name, scenario in ENVIRONMENTS.items():
        if name not in registration.registry:
            registration.register(
                name,
                entry_point='khr.environment:env',
                vector_entry_point='khr.vector:vector_env',
                kwargs={'scenario': scenario},
            )


class _OnceImported(MetaPathFinder):
    """Find Gymnasium's registry as anybody would, and register when it has been loaded."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != REGISTRY:
            return None
        sys.meta_path.remove(self)
        spec = PathFinder.find_spec(name, path, target)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_and_register(module: ModuleType) -> None:
                load(module)
                _register(module)

            spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec
