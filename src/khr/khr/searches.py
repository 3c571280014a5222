"""Critical inclinations and tuned gains: functions that are commands as well.

``khr critical`` and ``khr tune`` take their options, defaults and help from the signatures and
docstrings here (:mod:`khr.cli.options_of`). Imports are inside the functions, because the command
loads this module at every start.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from khr.arguments import Flag, ScenarioLike, checked

if TYPE_CHECKING:
    from khr_studies.measuring.condition import Condition
    from khr_studies.measuring.critical import Limit
    from khr_studies.tuning.study import Question, Tuning
    from khr_sweeps.pool import Pool

Settings = Annotated[Mapping[str, Any] | None, typer.Option('--set')]
# Parameters with an option of their own, which the title of a limit names.
KA, KH = '--ka (in Python ankle_gain)', '--kh (in Python hip_gain)'
STATED = {
    ('gait', 'motion'): '--walk or --stand (in Python motion)',
    ('simulator', 'surface'): '--surface (in Python surface)',
    ('ankle_controller', 'enabled'): KA,
    ('ankle_controller', 'gain'): KA,
    ('hip_controller', 'enabled'): KH,
    ('hip_controller', 'gain'): KH,
}
Workers = Annotated[int | None, typer.Option('--workers', '--jobs')]


@checked
def critical(
    motion: Annotated[str, Flag('walk', 'leg_lift'), typer.Option('--walk/--stand')] = 'walk',
    *,
    ankle_gain: Annotated[float, typer.Option('--ka')] = 0.0,
    hip_gain: Annotated[float, typer.Option('--kh')] = 0.0,
    surface: str = 'smooth',
    uphill: bool = False,
    set: Settings = None,
    robot: str = '',
    engine: str | None = None,
    seeds: int = 5,
    tolerance: float = 0.1,
    workers: Workers = None,
    out: str | PathLike[str] | None = None,
    progress: bool = False,
) -> Limit:
    """Measure the critical inclination, in deg, by one bisection per seed.

    Args:
        motion: ``walk``, or ``leg_lift``: standing on the force-sensor pads, lifting one
            leg, holding it and setting it down again.
        ankle_gain: Ankle gain K_A in board units; 0 is no control.
        hip_gain: Hip gain K_H in board units; 0 is no control.
        surface: Surface under a walk: ``smooth``, ``rubber`` or ``pads``.
        uphill: The robot faces uphill, and so falls backward.
        set: Change parameters of the scenario, ``node.parameter=value`` (in Python a dict of
            names and values), but not inclination, seed and initial tilt, which the search sets,
            nor motion, surface and gains.
        robot: Constants of another robot: ``leaning``, ``stiff`` or a parameter file.
        engine: Physics engine: ``bullet`` or ``mujoco``.
        seeds: Number of seeds of each measurement.
        tolerance: Tolerance of each bisection, in deg.
        workers: Processes on this machine; one per core by default.
        out: File for the runs as CSV, or for limit and runs as JSON: FILE.csv or FILE.json.
        progress: Show the progress on stderr.

    Returns:
        The limit of each seed in deg, with mean and confidence interval; ``runs`` is the table of
        all runs.

    Raises:
        KhrError: if a value is not accepted.

    Example:
        >>> import khr
        >>> found = khr.critical('leg_lift', engine='mujoco', seeds=1, tolerance=0.8)
        >>> 0.0 < found.mean < 20.0
        True
    """
    from khr_sweeps.pool import local_pool

    condition = condition_of(motion, ankle_gain, hip_gain, surface, uphill, set, engine, robot)
    with local_pool(workers, 'workers', quiet=not progress) as pool:
        return limit_of(condition, seeds, tolerance, out, pool)


def limit_of(
    condition: Condition, seeds: int, tolerance: float, out: str | PathLike[str] | None, pool: Pool
) -> Limit:
    """Measure the limit of a condition, and write it to a file if there is one.

    Raises:
        KhrError: if a value is not accepted, before anything runs.
    """
    from khr_report.output import check_file, make_folder
    from khr_studies.measuring.critical import measure_limit, write_limit

    if out:
        check_file(Path(out), '.csv', '.json')
    limit = measure_limit(condition, seeds, tolerance, pool)
    if out:
        make_folder(Path(out).parent)
        write_limit(limit, Path(out))
    return limit


def condition_of(
    motion: str,
    ankle_gain: float,
    hip_gain: float,
    surface: str,
    uphill: bool,
    set: Mapping[str, Any] | None,
    engine: str | None,
    robot: str = '',
    **_: Any,
) -> Condition:
    """Return the condition that :func:`critical` measures with the same arguments.

    Raises:
        KhrError: if a value is not accepted, or is one that the search sets.
    """
    from khr.runs import changes_of, named
    from khr_bringup.scenario.robots import constants_of
    from khr_common.checks import one_of
    from khr_common.errors import KhrError
    from khr_studies.measuring.condition import SEARCHED, Condition

    one_of('motion', motion, ('walk', 'leg_lift'))
    if motion == 'leg_lift' and surface != 'smooth':
        raise KhrError(
            f'--surface: {surface!r} is not accepted with leg_lift, which is always on the pads; '
            'accepted: smooth, the default'
        )
    own, constants = changes_of(named(set, engine=engine)), constants_of(robot)
    for option, given in (('--set', own), ('--robot', constants)):
        for node, key in given.keys() & (STATED.keys() | {*SEARCHED}):
            accepted = STATED.get((node, key), 'other parameters: the search sets this one')
            raise KhrError(
                f'{option}: {node}.{key}={given[node, key]} is not accepted; accepted: {accepted}'
            )
    changes = constants | own
    return Condition(motion, ankle_gain, hip_gain, surface, tuple(changes.items()), uphill)


@checked
def tune(
    scenario: Annotated[ScenarioLike, typer.Argument()],
    *,
    set: Settings = None,
    engine: str | None = None,
    gait: bool = False,
    robust: bool = False,
    seeds: int = 3,
    candidates: int = 64,
    seed: int = 0,
    workers: Workers = None,
    out: str | PathLike[str] | None = None,
    progress: bool = False,
) -> Tuning:
    """Find gains for a slope: most seeds up, then least vibration within 1 mm of the least slip.

    Args:
        scenario: Scenario with motion and slope: a name or file; in Python also a loaded one.
        set: Change parameters of the scenario, ``node.parameter=value`` (in Python a dict of names
            and values), but not seed and initial tilt, which the search sets.
        engine: Physics engine: ``bullet`` or ``mujoco``; the scenario's own by default.
        gait: Search the gait's placement of the centre of mass as well.
        robust: Find gains that hold for every robot of the ensemble that calibrate found.
        seeds: Runs of each candidate and robot.
        candidates: Most candidates to measure, besides the unchanged scenario, in generations of 8.
        seed: Seed of the optimiser.
        workers: Processes on this machine; one per core by default.
        out: Folder of the tuned scenario, page and plot, which also keeps finished runs; the
            command writes to ``runs/tune/NAME`` by default.
        progress: Show the progress on stderr.

    Returns:
        The best ``values`` by ``node.parameter``, the ``scenario`` with them, the ``front`` of slip
        against vibration, and all that was tried.

    Raises:
        KhrError: if a value is not accepted; with ``out``, if no candidate stayed up.

    Example:
        >>> import khr
        >>> found = khr.tune('stand_0deg', set={'simulator.duration': 0.3}, seeds=1, candidates=8)
        >>> sorted(found.values), float(found.best.up)
        (['ankle_controller.gain', 'hip_controller.gain'], 1.0)
        >>> khr.run(found.scenario).outcome.verdict
        'stood'
    """
    from khr_studies.tuning import page, study
    from khr_sweeps.pool import check_workers

    check_workers(workers, 'workers')
    question = question_of(scenario, set, engine, gait, robust, seeds, candidates, seed)
    with TemporaryDirectory() as temporary:
        folder = Path(temporary if out is None else out)
        found = study.tune(question, workers, folder / 'jobs', quiet=not progress)
        if out is not None:
            page.write(found, folder)
        return found


def question_of(
    scenario: ScenarioLike,
    set: Mapping[str, Any] | None,
    engine: str | None,
    gait: bool,
    robust: bool,
    seeds: int,
    candidates: int,
    seed: int,
    **_: Any,
) -> Question:
    """Return the search that :func:`tune` makes with the same arguments."""
    from khr.runs import prepared
    from khr_studies.tuning.study import define_search

    return define_search(
        prepared(scenario, set, engine=engine),
        gait=gait,
        robust=robust,
        seeds=seeds,
        candidates=candidates,
        seed=seed,
    )
