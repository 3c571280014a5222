"""Where a control period of the offline twin goes: ``python -m tests.benchmarks.bench_period``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from time import perf_counter
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

from khr_analysis.outcome import OutcomeMonitor
from khr_bringup.offline import ControlLoop, run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_sim.physics.engines import bullet as engine
from khr_sim.physics.engines.bullet import Bullet
from khr_sim.physics.world import World
from khr_sim.run_parameters import RunParameters
from tests.benchmarks.clock import Numbers, log

SCENARIO, SECONDS, ROUNDS = 'walk_0deg', 6.0, 5
STEPS, AROUND = "the engine's steps", 'servos, joint states and contacts around them'
BOTH = 'steps, servos and contacts, compiled together'
# What is timed beside the steps; the rest is board, clock, hash and loop.
TIMED = (
    (World, '_observe', 'poses and forces observed'),
    (ControlLoop, 'answer', 'sensors, gait and controllers'),
    (OutcomeMonitor, 'update', 'verdict'),
)
REST = 'the rest'


def measure(name: str) -> Numbers:
    """Return what each part of a control period takes on an engine, us: of the fastest round."""
    log(f'period: {name}')
    return min((_round(name) for _ in range(ROUNDS)), key=lambda found: sum(found.values()))


def _round(name: str) -> Numbers:
    scenario = scenarios.load_scenario(SCENARIO).changed(
        {('simulator', 'engine'): name, ('simulator', 'duration'): SECONDS}
    )
    spent: Counter[str] = Counter()

    def timed(part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            began = perf_counter()
            try:
                return function(*arguments, **options)
            finally:
                spent[part] += perf_counter() - began

        return call

    begun = [0.0]

    def watch(*_: object) -> None:
        if not begun[0]:
            spent.clear()
            begun[0] = perf_counter()

    with ExitStack() as stack:
        for owner, method, part in TIMED:
            stack.enter_context(patch.object(owner, method, timed(part, getattr(owner, method))))
        if name == 'bullet':
            step = timed(STEPS, engine.bullet.stepSimulation)
            own = SimpleNamespace(**(vars(engine.bullet) | {'stepSimulation': step}))
            stack.enter_context(patch.object(engine, 'bullet', own))
            stack.enter_context(patch.object(Bullet, 'run', timed(AROUND, Bullet.run)))
        else:
            from khr_sim.physics.engines.mujoco import MuJoCo

            stack.enter_context(patch.object(MuJoCo, 'run', timed(BOTH, MuJoCo.run)))
        seconds = run_offline(scenario, watch).time
    total = perf_counter() - begun[0]
    if name == 'bullet':
        spent[AROUND] -= spent[STEPS]
    spent[REST] = total - sum(spent.values())
    periods = seconds / scenario.table(RunParameters).control_period
    parts = (STEPS, AROUND, BOTH, *(part for *_, part in TIMED), REST)
    return {part: 1e6 * spent[part] / periods for part in parts if part in spent}


def main() -> None:
    """Measure both engines and print."""
    for name in ('bullet', 'mujoco'):
        found = measure(name)
        print(name, {part: round(value, 1) for part, value in found.items()})


if __name__ == '__main__':
    main()
