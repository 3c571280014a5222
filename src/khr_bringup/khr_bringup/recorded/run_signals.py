"""Signals of a run over time, sampled once per control period, for plots."""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from khr_analysis.outcome import Outcome
from khr_bringup.balance import BalanceSeries
from khr_bringup.changes import Change
from khr_bringup.node_registry import controllers, table_of
from khr_bringup.result import Result
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError
from khr_common.interfaces import JOINT_STATES, JOINTS, RECOVERY_STATE, REGIONS, STAGE, TRUE_POSE
from khr_common.rotation import pitch_of
from khr_sim.physics.truth import GroundTruth

if TYPE_CHECKING:
    from khr_bringup.offline import ControlLoop, Watch


Array = NDArray[np.float64]
IN_RADIANS = (
    'inclination',
    'read_inclination',
    'pitch',
    'gyro_rate',
    'correction',
    'constant',
    'joints',
)
ESTIMATES = ('center', 'capture')  # as of Margins
ESTIMATED = [RECOVERY_STATE.names.index(name) for name in ('com', 'capture_point')]
OF_PAGES = (
    'pose',
    'joints',
    'constant',
    'estimate',
)  # studies do not use them and do not keep them
# By the beginning of a name; angles are in deg.
UNITS = {
    'time': 's',
    'contact': 'N',
    'foot': 'N',
    'distance': 'm',
    'slip': 'm',
    'pose': 'm',
    'estimate': 'm',
}
POSE = ('x', 'y', 'z', 'qx', 'qy', 'qz', 'qw')


@dataclass(frozen=True, eq=False)
class Series:
    """The signals of one run; every array has one row per control period, the first at 0 s.

    Attributes:
        time: s, (N,).
        inclination: of the ground, rad, (N,).
        pitch: of the torso from the vertical, forward in its own heading positive, rad, (N,).
        pitch_rate: true one of the torso, mean over the period, rad/s, (N,).
        gyro_rate: the same as the board reads it, rad/s, (N,).
        contact_force: true normal forces on l_toe, l_heel, r_toe, r_heel, N, (N, 4).
        foot_force: the same as the sensors read them, N, (N, 4).
        correction: of each of the controllers, rad, (N, number of controllers).
        stage: of the control, 1 to 3, (N,); 0 without stages.
        read_inclination: of the ground as read back from the feet, rad, (N,); 0 without stages.
        distance: way of the torso along the surface, m, (N,).
        slip: way that the loaded soles have slid so far, m, (N,).
        controllers: short names of the controllers: ``ankle``, ``hip``, then any other.
        pose: of base_link in odom, x y z in m and quaternion x y z w, (N, 7); None if not kept.
        joints: angles of the 17 joints, rad, (N, 17); None if not kept.
        constant: part of each correction that no sensor causes, rad, as ``correction``; None if
            it is not known.
        estimate: centre of mass and capture point as the recovery node estimates them, m ahead of
            the middle of the soles, (N, 2); None without the node.
        balance: centre of mass, capture point, centre of pressure and edges; None if not computed.
    """

    time: Array
    inclination: Array
    pitch: Array
    pitch_rate: Array
    gyro_rate: Array
    contact_force: Array
    foot_force: Array
    correction: Array
    stage: Array
    read_inclination: Array
    distance: Array
    slip: Array
    controllers: tuple[str, ...] = ('ankle', 'hip')
    pose: Array | None = None
    joints: Array | None = None
    constant: Array | None = None
    estimate: Array | None = None
    balance: BalanceSeries | None = None

    @property
    def arrays(self) -> dict[str, Array]:
        """Return the signals by name."""
        found = {each.name: getattr(self, each.name) for each in fields(self)}
        return {name: each for name, each in found.items() if isinstance(each, np.ndarray)}

    @property
    def columns(self) -> dict[str, Array]:
        """Return the signals by name, (N,) each; a signal with several columns is split.

        Forces are split by foot region (``contact_force_l_toe``), corrections by controller
        (``correction_ankle``), the pose as ``pose_x``, the joints as ``joints_l_knee_pitch``.
        """
        parts = {
            'pose': POSE,
            'joints': JOINTS,
            'constant': self.controllers,
            'estimate': ESTIMATES,
            'contact_force': tuple(REGIONS.values()),
            'foot_force': tuple(REGIONS.values()),
            'correction': self.controllers,
        }
        found: dict[str, Array] = {}
        for name, values in self.arrays.items():
            if name in parts:
                found |= {
                    f'{name}_{part}': column
                    for part, column in zip(parts[name], values.T, strict=True)
                }
            else:
                found[name] = values
        return found

    @property
    def degrees(self) -> dict[str, Array]:
        """Return angles and rates in deg and deg/s, (N,) each.

        Their names have a suffix: ``pitch_deg``, ``gyro_rate_deg_s``, ``correction_ankle_deg``.
        """
        return {
            f'{name}_deg{"_s" if name.endswith("_rate") else ""}': np.degrees(values)
            for name, values in self.columns.items()
            if name.startswith(IN_RADIANS)
        }

    @property
    def with_units(self) -> dict[str, Array]:
        """Return the signals by name and unit, angles in deg: ``pitch, deg``, ``time, s``."""
        found = {}
        for name, values in self.columns.items():
            if name.startswith(IN_RADIANS):
                unit = 'deg/s' if name.endswith('_rate') else 'deg'
                found[f'{name}, {unit}'] = np.degrees(values)
            else:
                unit = '' if name.startswith('pose_q') else UNITS.get(name.partition('_')[0], '')
                found[f'{name}, {unit}' if unit else name] = values
        return found

    def correction_of(self, controller: str) -> Array:
        """Return the correction of a controller by its short name, rad, (N,); NaN without one."""
        return self._column(self.correction, self.controllers, controller)

    def constant_of(self, controller: str) -> Array:
        """Return the constant part of a correction, rad, (N,); NaN if it is not known."""
        return self._column(self.constant, self.controllers, controller)

    def margin(self, name: str) -> Array:
        """Return a part of the balance, m, (N,), by its name; NaN if it is not computed."""
        if self.balance is None:
            return np.full(len(self.time), np.nan)
        return np.asarray(getattr(self.balance, name))

    def estimate_of(self, name: str) -> Array:
        """Return ``center`` or ``capture`` as estimated, m, (N,); NaN without the node."""
        return self._column(self.estimate, ESTIMATES, name)

    def _column(self, values: Array | None, names: Sequence[str], name: str) -> Array:
        if values is None or name not in names:
            return np.full(len(self.time), np.nan)
        return np.asarray(values[:, names.index(name)])

    def during(self, shown: NDArray[np.bool_]) -> Series:
        """Return the signals at some of the times, given as a mask (N,)."""
        changes: dict[str, Any] = {name: values[shown] for name, values in self.arrays.items()}
        return replace(self, balance=None, **changes)

    def save(self, path: Path) -> None:
        """Write the signals in single precision; the file is whole or not there."""
        part = path.with_name(f'{path.name}.part')
        with part.open('wb') as file:
            single: Any = {
                name: values.astype(np.float32)
                for name, values in self.arrays.items()
                if name not in OF_PAGES
            }
            np.savez_compressed(file, controllers=np.array(self.controllers), **single)
        part.replace(path)

    @staticmethod
    def load(path: Path) -> Series:
        """Read the file that :meth:`save` wrote.

        Raises:
            KhrError: if it is not there or not readable.
        """
        try:
            with np.load(path) as stored:
                arrays: Any = {
                    name: values.astype(np.float64)
                    for name, values in stored.items()
                    if name != 'controllers'
                }
                return Series(**arrays, controllers=tuple(stored['controllers'].tolist()))
        except (
            OSError,
            EOFError,
            ValueError,
            KeyError,
            TypeError,
            NotImplementedError,  # a damaged version of the archive
            BadZipFile,
            zlib.error,
        ) as error:
            raise KhrError(
                f'{path}: not the signals of a run; accepted: a file that '
                'khr reproduce has written'
            ) from error


def run_with_series(scenario: Scenario, also: Watch | None = None) -> tuple[Result, Series]:
    """Run a scenario offline and keep its signals; ``also`` is called at each sample."""
    from khr_bringup.offline import run_offline  # a bag is read without gait and physics

    rows: list[tuple[Any, ...]] = []

    def look(truth: GroundTruth, loop: ControlLoop, outcome: Outcome) -> None:
        if also is not None:
            also(truth, loop, outcome)
        rows.append(
            (
                truth.stamp_ns / 1e9,
                truth.inclination,
                pitch_of(*truth.orientation.tolist()),
                float(truth.mean_angular_velocity[1]),
                loop.pitch_rate,
                truth.contact_force[:, 2].copy(),
                loop.forces,
                loop.corrections,
                *loop.stage,
                outcome.distance,
                outcome.slip_distance,
                loop.signals[TRUE_POSE],
                loop.signals[JOINT_STATES],
                loop.signals.get(STAGE, ()),
                loop.signals.get(RECOVERY_STATE, ()),
            )
        )

    result = run_offline(scenario, look)
    columns: Any = [np.array(column, dtype=np.float64) for column in zip(*rows, strict=True)]
    *signals, pose, joints, stages, recovery = columns
    constant = constant_parts(scenario, (), signals[0], stages)
    given: Any = (*signals, tuple(scenario.corrections))
    estimate = recovery[:, ESTIMATED] if recovery.size else None
    return result, replace(
        Series(*given), pose=pose, joints=joints, constant=constant, estimate=estimate
    )


def constant_part(node: str, table: Any, time: float, stage: Sequence[float] = ()) -> float:
    """Return the constant part of a correction, rad.

    Args:
        node: the controller.
        table: its parameters; a controller of another package may have no constant part.
        time: s.
        stage: the last sample of the topic ``stage``, if there is one.
    """
    if not hasattr(table, 'constant'):
        return 0.0
    share = 1.0
    if table.staged and len(stage) == len(STAGE.names):
        share = stage[STAGE.names.index(node)]
    return float(share * table.constant(time))


def constant_parts(
    scenario: Scenario, changes: Iterable[Change], times: Array, stages: Array
) -> Array:
    """Return the constant parts of the corrections of a run, rad, (N, number of controllers).

    Args:
        scenario: as it began.
        changes: of parameters while it ran.
        times: s, (N,).
        stages: samples of the topic ``stage`` at these times, (N, any).
    """
    nodes = [node for node in controllers() if node in scenario.nodes]
    found = np.zeros((len(times), len(nodes)))
    pending = sorted(changes, key=lambda change: change.time)
    tables = [scenario.table(table_of(node)) for node in nodes]
    for row, time in enumerate(times.tolist()):
        while pending and pending[0].time < time:
            change = pending.pop(0)
            scenario = scenario.changed({(change.node, change.parameter): change.value})
            tables = [scenario.table(table_of(node)) for node in nodes]
        stage = stages[row].tolist()
        for column, (node, table) in enumerate(zip(nodes, tables, strict=True)):
            found[row, column] = constant_part(node, table, time, stage)
    return found
