"""The parts of a run that its page shows, and a note on each part that is missing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from khr_bringup.balance import Balance, balances_of, margins_of
from khr_bringup.bout.recorded import bout_of_round
from khr_bringup.changes import Change
from khr_bringup.recorded.bags import AmbiguousError, bag_of
from khr_bringup.recorded.events import Event, events_of, timed_pushes
from khr_bringup.recorded.recorded_run import ACCEPTED, RecordedRun, has_messages
from khr_bringup.recorded.run_signals import Series, run_with_series
from khr_bringup.recorded.storage import is_recording, refuse_ros1
from khr_bringup.result import FILE, RunRecord
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.interfaces import OUTCOME, STATE, TRUE_POSE
from khr_common.interfaces import SCENARIO as SCENARIO_TOPIC
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters

Part = TypeVar('Part')


@dataclass
class RunContents:
    """The parts of a run that could be read."""

    name: str  # of its folder; of a round with that of its bout
    folder: Path  # of the run
    scenario: Scenario | None = None  # as it ran
    record: RunRecord | None = None  # the outcome
    series: Series | None = None  # the signals
    # at the samples of the signals; empty if the poses are not known
    balances: Sequence[Balance | None] = ()
    changes: tuple[Change, ...] = ()  # parameters that were set while it ran
    pushes: Sequence[Event] = ()  # timed by the scenario, or received over the topic
    version: str = ''  # of the code; empty if the run did not record it
    # the arithmetic, and versions of Python and the libraries; empty likewise
    made_with: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)  # on the parts that are missing, a line each
    robot: str = ''  # namespace of the robot; empty if none was given
    bout: Path | None = None  # folder of the bout of which the run is a round

    @property
    def parameters(self) -> Scenario:
        """Return the scenario, or one of defaults to interpret the signals."""
        return self.scenario or Scenario('', {})

    @property
    def events(self) -> list[Event]:
        """Return changes, pushes, stages and the fall."""
        judged = self.record.judged if self.record else None
        time, stage = (
            (self.series.time, self.series.stage) if self.series else (np.zeros(0), np.zeros(0))
        )
        fell = judged.fell_at if judged else None
        return events_of(fell, self.changes, time, stage, self.pushes)

    @property
    def title(self) -> str:
        """Return the title of the scenario."""
        return (self.scenario.title if self.scenario else '') or self.scenario_name or self.name

    @property
    def scenario_name(self) -> str:
        """Return the name of the scenario; empty if it is not known."""
        return self.record.scenario if self.record else ''

    def read(self, part: Callable[[], Part], note: str = '') -> Part | None:
        """Return a part; None if it cannot be read, which is noted."""
        try:
            return part()
        except AmbiguousError:
            raise
        except KhrError as error:
            self.notes.append(f'{error}{note}')
            return None


def is_foreign(path: Path, namespace: str = '') -> bool:
    """Return whether a path is a recording without a scenario and without an outcome of khr."""
    place = bag_of(path)
    if not path.exists() or not is_recording(place) or (path.is_dir() and place != path):
        return False
    try:
        return not has_messages(path, (SCENARIO_TOPIC, OUTCOME, STATE, TRUE_POSE), namespace)
    except KhrError:  # nothing of it can be read
        return False


def contents_of(path: Path, namespace: str = '') -> RunContents:
    """Read a run, its bag up to the first damage."""
    if not path.exists():
        raise KhrError(f'{path}: no such run; {ACCEPTED}')
    refuse_ros1(bag_of(path))
    run = RecordedRun(path, salvage=True, namespace=namespace)
    place, bout = path.resolve(), None
    with suppress(KhrError):  # a damaged file of the bout leaves the round
        bout = bout_of_round(place)
    name = '_'.join(place.relative_to(bout.parent).parts) if bout else run.name
    found = RunContents(name, run.folder, robot=namespace.strip('/'), bout=bout)
    if path.is_dir() and bout is None:  # the files of a bout are in its folder
        found.notes += [f'{n} is missing' for n in (SCENARIO, FILE) if not (path / n).is_file()]
    if found.read(lambda: run.text) is not None:
        found.version, found.made_with = run.version, run.made_with
        found.scenario = found.read(
            lambda: run.scenario, '; was it made by another version of the project?'
        )
    found.record = found.read(lambda: run.record)
    if run.has_bag:
        _read_bag(run, found)
    else:
        found.changes = found.record.changes if found.record else ()
        _repeat(found)
    return found


def _read_bag(run: RecordedRun, found: RunContents) -> None:
    if found.read(lambda: run.messages) is None:
        return
    record = found.record or run.recorded_outcome
    found.changes = run.changes or record.changes
    # any bag gives a record; without an outcome and an end it is empty
    stated = record.scenario or record.judged or record.trajectory_hash or record.end
    found.record = record if stated else None
    found.pushes = run.pushes
    found.series = found.read(lambda: run.series)
    if found.series is not None:
        _add_balance(found, found.series, run.robot)
    if run.damage:
        until = f' to {found.series.time[-1]:.2f} s' if found.series else ''
        found.notes.append(f'the bag is damaged; shown is what can be read{until} ({run.damage})')


def _add_balance(found: RunContents, series: Series, robot: Robot) -> None:
    balances = balances_of(series, robot, found.parameters.table(RunParameters))
    found.balances = balances or ()
    found.series = replace(series, balance=margins_of(balances)) if balances else series


def _repeat(found: RunContents) -> None:
    """Compute the signals of a run without a bag by repeating it, if the trajectory is the same."""
    record = found.record
    if (
        found.scenario is None
        or not (record and record.trajectory_hash)
        or record.end == 'stopped'
    ):
        found.notes.append('no bag, so no signals')
        return
    if found.scenario.table(RunParameters).sync != 'lockstep':
        found.notes.append(
            'no bag, so no signals: the run followed the wall clock and cannot be repeated'
        )
        return
    result, series = run_with_series(found.scenario)
    if result.trajectory_hash == record.trajectory_hash:
        _add_balance(found, series, Robot.load())
        found.pushes = timed_pushes(found.parameters.table(RunParameters).pushes)
        found.notes.append(
            'no bag; the signals are those of the run repeated, whose trajectory hash is the same'
        )
    else:
        found.notes.append(
            'no bag, so no signals: repeated, the run takes another trajectory; '
            'it was changed while it ran, or made by another version'
        )
