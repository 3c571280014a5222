"""The physics engines against each other: every scenario, every limit, and what moves a limit.

Two engines that solve the same mechanics differ as two step sizes of one engine do, or two
seeds. So each engine runs each scenario several times, and a difference between engines counts
only if it exceeds that scatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import degrees, hypot

import numpy as np

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.offline import run_offline
from khr_bringup.scenario import scenario as scenarios
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines import LIBRARIES
from khr_sim.physics.truth import Truth
from khr_studies.errors import check_integer
from khr_studies.measuring.bench import CYCLE, Bench
from khr_studies.measuring.condition import Changes, Condition, with_engine, with_seed
from khr_studies.measuring.limit import Limit
from khr_studies.measuring.thesis_values import LIMITS
from khr_sweeps.pool import local_pool

ENGINES = tuple(LIBRARIES)
LINES = (2, 4, 6)  # of the pitch rate over a gait cycle
RESTING = 1.0  # s at the end of a run, over which the forces of a standing robot are averaged
STUDIED = Condition('walk', 12.0)  # whose limit is measured under every change in any case
WALK = 'walk_0deg'  # whose numbers are taken under every change

# What a scenario's numbers scatter with: the size of the step, and the seeds.
SCATTER: tuple[Changes, ...] = (
    (),
    ((('simulator', 'physics_step'), 0.0005),),
    *map(with_seed, (1, 2)),
)
# What may move a limit: solver and step of each engine, and what the engines model differently.
STEPS: dict[str, Changes] = {
    'step 0.5 ms': ((('simulator', 'physics_step'), 0.0005),),
    'step 0.25 ms': ((('simulator', 'physics_step'), 0.00025),),
    '200 solver iterations': ((('simulator', 'solver_iterations'), 200),),
}
# A little less and a little more than the sole's own: an engine's friction by another name.
FRICTIONS: dict[str, Changes] = {
    f'friction {friction:.2f}': ((('simulator', 'friction'), friction),)
    for friction in (round(SimulatorParameters.friction_smooth + by, 2) for by in (-0.01, 0.01))
}
CAUSES: dict[str, dict[str, Changes]] = {
    'bullet': {**STEPS, **FRICTIONS},
    'mujoco': {
        **STEPS,
        'solver tolerance 1e-10': ((('simulator', 'solver_tolerance'), 1e-10),),
        'contact time 2 ms': ((('simulator', 'contact_time'), 0.002),),
        'contact time 16 ms': ((('simulator', 'contact_time'), 0.016),),
        'a pyramid of friction': ((('simulator', 'friction_cone'), 'pyramid'),),
        **FRICTIONS,
    },
}
CHANGES = [(engine, name, one) for engine, some in CAUSES.items() for name, one in some.items()]


@dataclass(frozen=True)
class Measured:
    """One run.

    Attributes:
        verdict: of the monitor.
        numbers: by the name of the quantity, with its unit; without what a fall makes void.
    """

    verdict: str
    numbers: dict[str, float]


@dataclass(frozen=True)
class Quantity:
    """One number of a scenario on both engines.

    Attributes:
        name: with its unit.
        values: over the scatter, per engine, the nominal run first.
    """

    name: str
    values: tuple[tuple[float, ...], tuple[float, ...]]

    @property
    def is_inside(self) -> bool:
        """Return whether the ranges over step size and seeds overlap."""
        first, second = self.values
        return max(min(first), min(second)) <= min(max(first), max(second))


@dataclass(frozen=True)
class ComparedScenario:
    """One scenario on both engines; verdicts are over the scatter, the nominal run first."""

    name: str
    verdicts: tuple[tuple[str, ...], tuple[str, ...]]
    quantities: tuple[Quantity, ...]

    @property
    def is_inside(self) -> bool:
        """Return whether the engines share a verdict."""
        return bool(set(self.verdicts[0]) & set(self.verdicts[1]))


@dataclass(frozen=True)
class ComparedLimit:
    """One limit on both engines."""

    title: str
    limits: tuple[Limit, Limit]

    @property
    def difference(self) -> float:
        """Return by how much the second engine's limit is higher, deg."""
        return self.limits[1].mean - self.limits[0].mean

    @property
    def scatter(self) -> float:
        """Return what the difference scatters by, deg: both intervals."""
        return hypot(*(limit.half_width for limit in self.limits))

    @property
    def is_inside(self) -> bool:
        """Return whether the difference is within the scatter."""
        return abs(self.difference) <= self.scatter


@dataclass(frozen=True)
class Cause:
    """What one change does to a limit on one engine."""

    engine: str
    change: str
    limit: Limit
    moved: float  # deg


@dataclass(frozen=True)
class StudiedLimit:
    """A limit on both engines, under one change at a time."""

    compared: ComparedLimit
    causes: tuple[Cause, ...]

    @property
    def explanations(self) -> tuple[str, ...]:
        """Name the changes that bring one engine's limit to the other's, within the scatter."""
        return tuple(
            f'{cause.engine} with {cause.change}'
            for cause in self.causes
            if abs(cause.limit.mean - self._other(cause).mean) <= self.compared.scatter
        )

    def _other(self, cause: Cause) -> Limit:
        return self.compared.limits[1 - ENGINES.index(cause.engine)]


@dataclass(frozen=True)
class ChangedWalk:
    """The numbers of :data:`WALK` under one change."""

    engine: str
    change: str
    numbers: dict[str, float]


@dataclass(frozen=True)
class Comparison:
    """All that ``khr engines`` measures."""

    seeds: int
    tolerance: float
    scenarios: tuple[ComparedScenario, ...]
    limits: tuple[ComparedLimit, ...]
    studied: tuple[StudiedLimit, ...]
    walks: tuple[ChangedWalk, ...]


def measure_scenario(name: str, changes: Changes) -> Measured:
    """Run a scenario offline and take its numbers."""
    scenario = scenarios.load_scenario(name).changed(dict(changes))
    gait = scenario.table(GaitParameters)
    truths: list[Truth] = []
    result = run_offline(scenario, lambda truth, *_: truths.append(truth))
    outcome = result.outcome
    numbers = {'vibration, deg/s': degrees(outcome.vibration)}
    if outcome.fell:
        return Measured(outcome.verdict, {'fall, s': outcome.fell_at or result.time})
    numbers |= {'distance, m': outcome.distance, 'largest slip, mm': 1000.0 * outcome.largest_slip}
    times = np.array([truth.stamp_ns / 1e9 for truth in truths])
    if gait.motion == 'walk':
        start, end = gait_of(gait).cycle(CYCLE)
        inside = (times >= start - 1e-9) & (times < end - 1e-9)
        rates = np.array([truth.mean_angular_velocity[1] for truth in truths])[inside]
        for line in LINES:
            turn = np.exp(-2j * np.pi * line * (times[inside] - start) / (end - start))
            numbers[f'Gait-3 line {line}, deg/s'] = degrees(2.0 * abs(np.mean(rates * turn)))
    else:
        last = [truth for truth in truths if truth.stamp_ns / 1e9 > times[-1] - RESTING]
        forces = np.mean([truth.contact_force[:, 2] for truth in last], axis=0)
        numbers['toes, N'], numbers['heels, N'] = forces[0::2].sum(), forces[1::2].sum()
    return Measured(outcome.verdict if outcome.stayed_up else 'rode down', numbers)


def compare_engines(
    seeds: int, tolerance: float, jobs: int | None, only: str | None = None
) -> Comparison:
    """Compare the engines with a pool of processes.

    Args:
        seeds: of every limit.
        tolerance: of each bisection, deg.
        jobs: processes; one per core by default.
        only: names of scenarios with commas; all that are shipped if left out.

    Raises:
        StudyError: if an argument is not accepted.
    """
    check_integer('--seeds', seeds, 2, 100)
    names = only.split(',') if only else [path.stem for path in scenarios.shipped()]
    for name in names:
        scenarios.load_scenario(name)  # a mistake is reported before anything starts
    with local_pool(jobs, '--jobs') as pool:
        return compare(Bench(pool, seeds, tolerance), names)


def compare(bench: Bench, names: Sequence[str]) -> Comparison:
    """Run scenarios on both engines, and measure the limits and what moves them.

    Args:
        bench: measures, with seeds and tolerance of its own.
        names: of the scenarios.
    """
    for name, engine, changes in product(names, ENGINES, SCATTER):
        bench.submit(measure_scenario, name, with_engine(engine, changes))
    for row, engine in product(LIMITS, ENGINES):
        bench.ask_limit(_condition(row.condition, engine))
    for engine, _, changes in CHANGES:
        bench.submit(measure_scenario, WALK, with_engine(engine, changes))
    limits = {row.condition: _compared(bench, row.condition) for row in LIMITS}
    studied = [
        condition
        for condition, limit in limits.items()
        if condition == STUDIED or not limit.is_inside
    ]
    for condition, (engine, _, changes) in product(studied, CHANGES):
        bench.ask_limit(_condition(condition, engine, changes))
    return Comparison(
        bench.seeds,
        bench.tolerance,
        tuple(_scenario(bench, name) for name in names),
        tuple(limits.values()),
        tuple(_studied(bench, condition, limits[condition]) for condition in studied),
        tuple(
            ChangedWalk(
                engine,
                change,
                bench.submit(measure_scenario, WALK, with_engine(engine, changes))
                .result()
                .numbers,
            )
            for engine, change, changes in CHANGES
        ),
    )


def _condition(condition: Condition, engine: str, changes: Changes = ()) -> Condition:
    return replace(condition, changes=with_engine(engine, changes))


def _compared(bench: Bench, condition: Condition) -> ComparedLimit:
    first, second = (bench.limit(_condition(condition, engine)) for engine in ENGINES)
    return ComparedLimit(condition.title, (first, second))


def _studied(bench: Bench, condition: Condition, compared: ComparedLimit) -> StudiedLimit:
    causes = []
    for engine, change, changes in CHANGES:
        limit = bench.limit(_condition(condition, engine, changes))
        plain = compared.limits[ENGINES.index(engine)]
        causes.append(Cause(engine, change, limit, limit.mean - plain.mean))
    return StudiedLimit(compared, tuple(causes))


def _scenario(bench: Bench, name: str) -> ComparedScenario:
    runs = [
        [
            bench.submit(measure_scenario, name, with_engine(engine, changes)).result()
            for changes in SCATTER
        ]
        for engine in ENGINES
    ]
    first, second = (tuple(run.verdict for run in of_engine) for of_engine in runs)
    names = [key for key in runs[0][0].numbers if key in runs[1][0].numbers]
    quantities = []
    for key in names:
        a, b = (
            tuple(run.numbers[key] for run in of_engine if key in run.numbers)
            for of_engine in runs
        )
        quantities.append(Quantity(key, (a, b)))
    return ComparedScenario(name, (first, second), tuple(quantities))
