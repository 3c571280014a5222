"""Run the simulated KHR-3HV from Python, with the same trajectories as the ``khr`` command::

    import khr

    walk = khr.run('walk_7.68deg_ka12', set={'ankle_controller.gain': 15})
    print(walk.outcome.verdict, walk.trajectory_hash)
    spectrum = khr.spectrum(walk)

Errors are :class:`khr.KhrError`, one line that names the accepted values. Nothing is printed
without ``progress=True``. Studies of many runs use a process per core. Numbers are in SI units;
angles and rates are also given in degrees, with ``_deg`` in the name.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from khr.bout_environment import BoutEnv, bout_env
    from khr.environment import BalanceEnv, env
    from khr.runs import RunResult, load, run, scenarios
    from khr.searches import critical, tune
    from khr.studies import spectrum, stage3, sweep
    from khr_common import KhrError

__all__ = [
    'BalanceEnv',
    'BoutEnv',
    'KhrError',
    'RunResult',
    'bout_env',
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
    'khr.bout_environment': ('BoutEnv', 'bout_env'),
    'khr.environment': ('BalanceEnv', 'env'),
    'khr.runs': ('RunResult', 'load', 'run', 'scenarios'),
    'khr.searches': ('critical', 'tune'),
    'khr.studies': ('spectrum', 'stage3', 'sweep'),
    'khr_common': ('KhrError',),
}


def __getattr__(name: str) -> Any:
    """Import the module of a name on first use: a spectrum needs no physics engine."""
    from importlib import import_module

    for module, names in _HOMES.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')


def __dir__() -> list[str]:
    return __all__
