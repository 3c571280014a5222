"""Experiments: the shipped sweeps of the figures, and their finished runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import pandas as pd

from khr_bringup.code_version import code_version
from khr_bringup.recorded.run_signals import Series
from khr_bringup.scenario.robots import label_of, on_robot
from khr_bringup.scenario.scenario import CONFIG, Scenario
from khr_common.errors import KhrError
from khr_sim.physics import engines
from khr_sim.run_parameters import RunParameters
from khr_studies.measuring.condition import ENGINE
from khr_studies.measuring.run_table import parameter_columns, run_table
from khr_sweeps.pool import Pool, local_pool
from khr_sweeps.progress import ProgressBar
from khr_sweeps.reading import load_sweep
from khr_sweeps.results.folder import Folder, read_results, request_of, series_path
from khr_sweeps.specification import Sweep, scenario_at
from khr_sweeps.sweep import report_lost, run_missing
from khr_sweeps.trial import RESULTS

ROOT = Path('runs/experiments')
Key = TypeVar('Key')
Item = TypeVar('Item')


@dataclass(frozen=True, eq=False)
class Run:
    """One finished run of an experiment."""

    point: dict[str, Any]  # the swept values: scenario, case, node.parameter
    seed: int | None  # None if the experiment does not set the seed of the scenario
    row: dict[str, Any]  # results by column of RESULTS
    scenario: Scenario  # with all swept values
    kept: Path  # file of the signals

    @property
    def fell(self) -> bool:
        """Return whether the run ended in a fall."""
        return bool(self.row['verdict'] == 'fell')

    @property
    def stayed_up(self) -> bool:
        """Return whether the robot neither fell nor rode down the slope on its soles."""
        return bool(self.row['stayed_up'])

    @cached_property
    def series(self) -> Series | None:
        """Load the signals; None if they were not kept or the run failed."""
        return Series.load(self.kept) if self.kept.is_file() else None


Runs = list[Run]
OpenSweep = tuple[Sweep, Folder]


def runs_of(folder: Path) -> Runs:
    """Return the finished runs in the folder of a sweep by its axes, then by seeds."""
    results = read_results(folder)
    request = request_of(results)
    axes: dict[str, Any] = request['axes']

    def place(run: Run) -> tuple[Any, ...]:
        return (
            *(
                axis.index(run.point[name]) if isinstance(axis, list) else run.point[name]
                for name, axis in axes.items()
            ),
            -1 if run.seed is None else run.seed,
        )

    runs = []
    for row in results.to_pylist():
        point = {name: row[name] for name in axes}
        runs.append(
            Run(
                point,
                row['seed'],
                {name: row[name] for name in RESULTS},
                scenario_at(request, point, row['seed']),
                series_path(folder, row['id']),
            )
        )
    return sorted(runs, key=place)


def table_of(runs: Sequence[Run]) -> pd.DataFrame:
    """Return the run table of experiments; row i belongs to ``runs[i]``.

    The columns are all parameters (:func:`parameter_columns`), the swept values, ``seed``,
    ``engine`` and the results; rows without a verdict have no outcome.
    """
    return run_table(
        {
            **parameter_columns(run.scenario),
            **run.point,
            'seed': run.seed,
            'engine': run.scenario.table(RunParameters).engine,
            **run.row,
        }
        for run in runs
    )


def group_by(items: Iterable[Item], key: Callable[[Item], Key]) -> dict[Key, list[Item]]:
    """Group items by a key, in order of first occurrence."""
    groups: dict[Key, list[Item]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def experiment_files() -> dict[str, Path]:
    """Return the files of the experiments by name; ``./config`` overrides the shipped files."""
    return {
        path.stem: path
        for place in (CONFIG, Path('config'))
        for path in sorted((place / 'experiments').glob('*.yaml'))
    }


def specification_of(name: str, fast: bool) -> Sweep:
    """Read an experiment."""
    files = experiment_files()
    if name not in files:
        raise KhrError(f'experiment: {name!r} is not known; accepted: {", ".join(files)}')
    return load_sweep(files[name], fast)


def root_of(engine: str, robot: str = '') -> Path:
    """Return the folder of all experiments on a physics engine, with a robot."""
    root = ROOT / 'robots' / label_of(robot) if robot else ROOT
    return root if engine == engines.DEFAULT else root / engine


def folder_of(name: str, fast: bool, engine: str = engines.DEFAULT, robot: str = '') -> Path:
    """Return the folder of an experiment."""
    return root_of(engine, robot) / (f'{name}-fast' if fast else name)


def sweeps_of(
    names: Iterable[str], fast: bool, engine: str = engines.DEFAULT, robot: str = ''
) -> dict[Path, Sweep]:
    """Read experiments, or their quick form; return them by folder.

    Args:
        robot: constants of another robot, by name or file; the default one if empty.
    """
    change = {ENGINE: engine} if engine != engines.DEFAULT else {}
    found = {}
    for name in names:
        sweep = specification_of(name, fast)
        scenarios = {
            label: on_robot(one, robot).changed(change) for label, one in sweep.scenarios.items()
        }
        found[folder_of(name, fast, engine, robot)] = replace(sweep, scenarios=scenarios)
    return found


@contextmanager
def open_sweeps(sweeps: Mapping[Path, Sweep]) -> Iterator[list[OpenSweep]]:
    """Open the folders of sweeps to add missing runs; export their results on exit.

    Waits for a folder that another command is writing. Runs of another version of the code or the
    experiment are discarded.
    """
    with ExitStack() as stack:
        entered = []
        for path, specification in sweeps.items():
            request = {'version': code_version(), **specification.record()}
            folder = stack.enter_context(Folder(path, request, wait=True, replace=True))
            if folder.replaced:
                print(
                    f'khr: {path}: its runs are of another version or experiment and are repeated',
                    file=sys.stderr,
                )
            entered.append((specification, folder))
        try:
            yield entered
        finally:
            for _, folder in entered:
                folder.export()


def count_missing(sweeps: Sequence[OpenSweep]) -> int:
    """Count the missing runs of open sweeps."""
    version = code_version()
    return sum(
        specification.count_missing(version, folder.finished()) for specification, folder in sweeps
    )


def run_open(pool: Pool, sweeps: Sequence[OpenSweep], bar: ProgressBar) -> int:
    """Compute the missing runs of open sweeps; return the number of runs that lost their worker.

    Raises:
        RunError: if the computation had to stop; finished runs are kept.
    """
    lost, simulated = 0, 0.0  # runs, s
    for batch in run_missing(pool, sweeps):
        lost += batch.count(None)
        simulated += sum(row['time_s'] or 0.0 for row in batch if row is not None)
        bar.advance(len(batch), f'{simulated:.0f} s simulated')
    return lost


def run_sweeps(sweeps: Mapping[Path, Sweep], workers: int, title: str = 'experiments') -> None:
    """Compute the missing runs of sweeps, given by folder, on this machine.

    Raises:
        RunError: if the computation had to stop; finished runs are kept.
    """
    with open_sweeps(sweeps) as entered:
        left = count_missing(entered)
        if not left:
            return
        with ProgressBar(title, left, lines=True) as bar, local_pool(min(workers, left)) as pool:
            lost = run_open(pool, entered, bar)
    report_lost(lost)


def runs_by_name(
    names: Iterable[str], fast: bool = False, engine: str = engines.DEFAULT, robot: str = ''
) -> dict[str, Runs]:
    """Return the finished runs of experiments."""
    return {name: runs_of(folder_of(name, fast, engine, robot)) for name in names}
