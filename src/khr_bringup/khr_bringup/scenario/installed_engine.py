"""The physics engine of a scenario that names none, by what is installed."""

from __future__ import annotations

import sys
from functools import cache
from importlib.util import find_spec
from typing import Any, TypeVar

from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines import LIBRARIES

OTHER = 'mujoco'
# a scenario, whose module imports this one
Chosen = TypeVar('Chosen', bound=Any)


def with_installed_engine(scenario: Chosen) -> Chosen:
    """Return a scenario on MuJoCo if it names no engine and PyBullet is not installed.

    PyBullet has no wheel for Python 3.12 and later.
    """
    stated = 'engine' in scenario.values.get('simulator', {})
    if stated or _installed(LIBRARIES[SimulatorParameters().engine]):
        return scenario
    _say()
    changed: Chosen = scenario.changed({('simulator', 'engine'): OTHER})
    return changed


@cache
def _installed(library: str) -> bool:
    return find_spec(library) is not None


@cache
def _say() -> None:
    print(
        'khr: PyBullet is not installed (it has no wheel for this Python): MuJoCo is the engine; '
        '"make bullet" compiles PyBullet',
        file=sys.stderr,
    )
