"""Run the simulated KHR-3HV from Python: the same runs as the ``khr`` command's::

    import khr

    walk = khr.run('walk_7.68deg_ka12', set={'ankle_controller.gain': 15})
    print(walk.outcome.verdict, walk.trajectory_hash)
    spectrum = khr.spectrum(walk)

Every function raises :class:`khr.KhrError`, with one line that says what is accepted. None prints
anything unless asked for ``progress``; what takes many runs has a process on each core. Numbers
are in SI units; angles and rates are there in degrees as well, with ``_deg`` in the name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from khr.environment import BalanceEnv, env
    from khr.runs import RunResult, load, run, scenarios
    from khr.searches import critical, tune
    from khr.studies import spectrum, stage3, sweep
    from khr_common import KhrError

__all__ = [
    'BalanceEnv',
    'KhrError',
    'RunResult',
    'critical',
    'env',
    'load',
    'run',
    'scenarios',
    'spectrum',
    'stage3',
    'sweep',
    'tune',
]
_HOMES = {
    'khr.environment': ('BalanceEnv', 'env'),
    'khr.runs': ('RunResult', 'load', 'run', 'scenarios'),
    'khr.searches': ('critical', 'tune'),
    'khr.studies': ('spectrum', 'stage3', 'sweep'),
    'khr_common': ('KhrError',),
}


def __getattr__(name: str) -> Any:
    """Import what is asked for: a spectrum needs no physics, and a run no environment."""
    from importlib import import_module

    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return __all__
