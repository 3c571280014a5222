"""One run: its scenario, outcome, trajectory hash and signals."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pyarrow as pa

from khr.arguments import ScenarioLike, checked
from khr_analysis.outcome_values import labelled
from khr_bringup.balance import balance_of
from khr_bringup.bout.recorded import played
from khr_bringup.offline import duration as length
from khr_bringup.recorded.events import events_of
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.recorded.run_signals import Series, run_with_series
from khr_bringup.result import Result
from khr_bringup.running import offline_progress
from khr_bringup.scenario import scenario as scenario_files
from khr_bringup.scenario.parameter_file import typed
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, kw_only=True)
class RunResult(Result):
    """A finished run and its signals; a notebook shows the command's summary of it.

    ``outcome`` holds the verdict, distance in m, largest pitch in rad and as
    ``largest_pitch_deg``, slip in m, vibration in rad/s and as ``vibration_deg_s``. ``scenario``
    is as it ran, with every change.

    Attributes:
        signals: NumPy arrays with one row per control period.

    Example:
        >>> import khr
        >>> stand = khr.run('stand_0deg', duration=0.3)
        >>> stand.outcome.verdict, stand.outcome.largest_pitch_deg < 15.0
        ('stood', True)
        >>> stand.signals.foot_force.shape
        (21, 4)
    """

    signals: Series

    def table(self) -> pa.Table:
        """Return the signals as an Arrow table; ``.to_pandas()`` makes a data frame, with pandas.

        One row per control period. Units are SI, as in :attr:`signals`, and angles and rates have a
        second column in degrees, such as ``pitch_deg`` and ``gyro_rate_deg_s``. Arrays with a
        column per foot region, controller or joint are split, such as ``contact_force_l_toe`` and
        ``joints_l_knee_pitch``. ``pose_*`` is the pose of the torso, ``constant_*`` the part of a
        correction that no sensor causes, ``balance_*`` places ahead of the middle of the soles:
        centre of mass, capture point, centre of pressure, toe and heel edge. Lean (``pitch``) and
        balance are in the heading of the robot, forward positive.

        Example:
            >>> import khr
            >>> table = khr.run('stand_0deg', duration=0.3).table()
            >>> table.num_rows, table.column_names[:3]
            (21, ['time', 'inclination', 'pitch'])
            >>> 'gyro_rate' in table.column_names, 'gyro_rate_deg_s' in table.column_names
            (True, True)
        """
        balance = balance_of(self.signals, Robot.load(), self.scenario.table(RunParameters))
        margins = {} if balance is None else vars(balance)
        return pa.table(
            self.signals.columns
            | self.signals.degrees
            | {f'balance_{name}': values for name, values in margins.items()}
        )

    def plot(self) -> Figure:
        """Draw pitch rate, foot forces, corrections and spectrum, in deg and N.

        A notebook shows the figure that is returned; ``.savefig`` writes it.

        Example:
            >>> import khr
            >>> figure = khr.run('stand_0deg', duration=0.3).plot()
            >>> figure.savefig('stand.png')
        """
        from khr_report.plots.plot_style import styled  # a run needs no pictures
        from khr_report.run.overview import overview

        fell = self.judged.fell_at if self.judged else None
        events = events_of(fell, (), self.signals.time, self.signals.stage)
        with styled():
            return overview(self.signals, self.scenario, events)

    def __repr__(self) -> str:
        """Show verdict, length and hash; the signals are long."""
        return (
            f'RunResult({self.scenario.name!r}, {self.verdict or "not judged"}, {self.time:.3f} s, '
            f'trajectory hash {self.trajectory_hash[:12]}...)'
        )

    def _repr_html_(self) -> str:
        """Return the command's summary as an HTML table."""
        from khr_report.page.html import part

        rows = [
            ('outcome', self.verdict),
            *labelled(self.judged).items(),
            ('ended by', self.end),
            ('trajectory hash', self.trajectory_hash),
        ]
        return part('table', [self.scenario.title or self.scenario.name, ''], rows)


def scenarios() -> list[str]:
    """Return the names of the scenarios that come with the project.

    Example:
        >>> import khr
        >>> [name for name in khr.scenarios() if name.startswith('walk_7')]
        ['walk_7.68deg_ka12']
    """
    return [path.stem for path in scenario_files.shipped()]


@checked
def run(
    scenario: ScenarioLike,
    *,
    set: Mapping[str, Any] | None = None,
    engine: str | None = None,
    duration: float | None = None,
    seed: int | None = None,
    progress: bool = False,
) -> RunResult:
    """Run a scenario offline: no ROS, and the trajectory of the nodes, bit for bit.

    Args:
        scenario: name of a scenario, its file, or one that has been loaded.
        set: parameters to change, by ``node.parameter``.
        engine: ``bullet`` or ``mujoco``; the scenario's own by default.
        duration: simulated s; that of the motion by default.
        seed: of placing errors and sensor noise; the scenario's own by default.
        progress: whether to show the progress on a terminal.

    Raises:
        KhrError: if there is no such scenario, or a value is not accepted.

    Example:
        >>> import khr
        >>> fast = khr.run('stand_0deg', engine='mujoco', duration=0.3, seed=7)
        >>> fast.outcome.verdict
        'stood'
        >>> again = khr.run('stand_0deg', engine='mujoco', duration=0.3, seed=7)
        >>> fast.trajectory_hash == again.trajectory_hash
        True
    """
    chosen = prepared(scenario, set, engine=engine, duration=duration, seed=seed)
    with ExitStack() as shown:
        also = None
        if progress:
            from khr_sweeps.progress import ProgressBar, show_run

            bar = shown.enter_context(ProgressBar(total=length(chosen), unit='s'))
            also = offline_progress(partial(show_run, bar))
        result, signals = run_with_series(chosen, also)
    return RunResult(**vars(result), signals=signals)


@checked
def load(path: str | PathLike[str], *, namespace: str = '') -> RunResult:
    """Read a recorded run: a folder that ``khr run`` has written, or its bag.

    Of the folder of a bout the first round is read; ``round_2`` in it is the second.

    Args:
        path: the folder or bag; one of the files of the bag, too.
        namespace: of the robot, in a bag of several.

    Raises:
        KhrError: if it is no bag, is damaged, or holds no run.

    Example:
        >>> import khr, subprocess
        >>> stand = ['khr', 'run', 'stand_0deg', '--duration', '0.3', '--out', 'mine']
        >>> _ = subprocess.run(stand, check=True, capture_output=True)
        >>> recorded, repeated = khr.load('mine'), khr.run('stand_0deg', duration=0.3)
        >>> recorded.trajectory_hash == repeated.trajectory_hash
        True
    """
    recorded = RecordedRun(played(Path(path)), namespace=namespace)
    signals, outcome = recorded.signals
    if outcome is None and not recorded.has_scenario:
        raise KhrError(f'{path}: no signals in it; accepted: the bag of a khr run')
    stored = recorded.recorded_outcome
    return RunResult(
        scenario=recorded.parameters,
        judged=outcome or stored.judged,
        trajectory_hash=stored.trajectory_hash,
        end=stored.end,
        time=float(signals.time[-1]),
        changes=stored.changes,
        signals=signals,
    )


def prepared(
    scenario: ScenarioLike, set: Mapping[str, Any] | None = None, **of_simulator: Any
) -> Scenario:
    """Return a scenario with changes; ``of_simulator`` may contain None.

    Args:
        scenario: its name, its file, or one that has been loaded.
        set: parameters to change, by ``node.parameter``.
        of_simulator: parameters of the simulator.

    Raises:
        KhrError: if there is no such scenario, or a value is not accepted.
    """
    base = (
        scenario if isinstance(scenario, Scenario) else scenario_files.load_scenario(str(scenario))
    )
    return base.changed(changes_of(named(set, **of_simulator)))


def named(set: Mapping[str, Any] | None = None, **of_simulator: Any) -> dict[str, Any]:
    """Return changes by ``node.parameter``, with those of the simulator that are not None."""
    stated = {key: value for key, value in of_simulator.items() if value is not None}
    return {**(set or {}), **{f'simulator.{key}': value for key, value in stated.items()}}


def changes_of(given: Mapping[str, Any] | None) -> dict[tuple[str, str], Any]:
    """Return changes by node and parameter.

    Raises:
        KhrError: if a name is not ``node.parameter``.
    """
    changes: dict[tuple[str, str], Any] = {}
    for name, value in (given or {}).items():
        node, dot, parameter = str(name).partition('.')
        if not dot or not parameter:
            raise KhrError.refused('set', name, 'NODE.PARAMETER')
        changes[node, parameter] = typed(node, parameter, plain(value))
    return changes


def plain(value: Any) -> Any:
    """Return numbers and arrays of NumPy, also within a list, as numbers and lists."""
    if isinstance(value, (np.generic, np.ndarray)):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in value]
    return value
