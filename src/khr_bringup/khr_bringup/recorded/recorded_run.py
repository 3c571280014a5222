"""The one reader of a finished run: its folder, or its bag."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from khr_analysis.outcome import Outcome
from khr_analysis.outcome_values import outcome_of
from khr_bringup.changes import Change, changes_in
from khr_bringup.code_version import version_in, versions_in
from khr_bringup.recorded.bag_signals import series_of, signal_topics
from khr_bringup.recorded.bags import (
    AmbiguousError,
    Messages,
    NumbersOf,
    bag_of,
    final_state,
    full_name,
    read_messages,
    read_what_is_left,
)
from khr_bringup.recorded.channel import topics_in
from khr_bringup.recorded.events import Event, received_push, timed_pushes
from khr_bringup.recorded.run_signals import Series
from khr_bringup.recorded.storage import is_recording
from khr_bringup.result import FILE, RunRecord, read_outcome
from khr_bringup.run_folder import SCENARIO as SCENARIO_FILE
from khr_bringup.scenario.scenario import Scenario, parse
from khr_common import KhrError, cdr
from khr_common.errors import MalformedError
from khr_common.interfaces import (
    DIAGNOSTICS,
    OUTCOME,
    PUSHED,
    ROBOT_DESCRIPTION,
    SCENARIO,
    STATE,
    Topic,
)
from khr_common.strict_yaml import read_file
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters

ABOUT_THE_RUN = (SCENARIO, STATE, OUTCOME, DIAGNOSTICS, PUSHED, ROBOT_DESCRIPTION)
ACCEPTED = 'accepted: the folder of a khr run, or its bag'


def has_messages(path: Path, topics: Iterable[Topic], namespace: str = '') -> bool:
    """Return whether a recording, damaged or not, has messages of one of some topics of a robot.

    Args:
        path: the recording, one of its files, or the folder of a run.
        topics: of the robot; another type does not count.
        namespace: of the robot; any if empty.

    Raises:
        KhrError: if it is no recording, or nothing of it can be read.
    """
    recorded = [each for each in topics_in(path)[0] if each.messages]
    if namespace:
        names = {(full_name(topic, namespace.strip('/')), topic.kind) for topic in topics}
        return any((each.name, each.kind) in names for each in recorded)
    ends = [('/' + topic.name.lstrip('/'), topic.kind) for topic in topics]
    return any(
        each.name.endswith(end) and each.kind == kind for each in recorded for end, kind in ends
    )


class RecordedRun:
    """A finished run; each part is read when it is first used.

    Args:
        path: the folder of the run, or its bag.
        topics: to read from the bag besides ``ABOUT_THE_RUN``; the signals by default.
        salvage: read a damaged bag up to the damage.
        numbers_of: reader of the messages of a sampled topic.
        namespace: of the robot, in a bag of several; the only one if empty.

    Attributes:
        name: of the folder or bag.
        folder: the folder of the run.
    """

    def __init__(
        self,
        path: Path,
        topics: Iterable[Topic] | None = None,
        *,
        salvage: bool = False,
        numbers_of: NumbersOf = cdr.numbers_of,
        namespace: str = '',
    ) -> None:
        self.path, self.name = path, path.resolve().name
        self.folder = path if path.is_dir() else path.parent
        sampled = signal_topics() if topics is None else topics
        self._topics = tuple(dict.fromkeys((*ABOUT_THE_RUN, *sampled)))
        self._salvage, self._numbers_of, self._namespace = salvage, numbers_of, namespace

    @property
    def has_bag(self) -> bool:
        """Return whether there is a bag, damaged or not."""
        return self.path.is_file() or bag_of(self.path) != self.path or is_recording(self.path)

    @property
    def messages(self) -> Messages:
        """Return the messages of the bag by topic, in the order they were recorded.

        Raises:
            KhrError: if there is no bag, or it cannot be read.
        """
        if isinstance(self._bag, KhrError):
            raise self._bag
        return self._bag[0]

    @property
    def damage(self) -> str:
        """Describe the damage of the bag in one line; empty if it is whole."""
        return str(self._bag) if isinstance(self._bag, KhrError) else self._bag[1]

    @cached_property
    def _bag(self) -> tuple[Messages, str] | KhrError:
        try:
            if self._salvage:
                return read_what_is_left(self.path, self._topics, self._namespace)
            return read_messages(self.path, self._topics, self._numbers_of, self._namespace), ''
        except AmbiguousError:
            raise
        except KhrError as error:
            return error

    @cached_property
    def text(self) -> str:
        """Return the text of the scenario, from the bag or else ``scenario.yaml``.

        Raises:
            KhrError: if there is neither, or the file cannot be read.
        """
        if not isinstance(self._bag, KhrError) and self._bag[0][SCENARIO]:
            return str(self._bag[0][SCENARIO][-1].data)
        file = self.folder / SCENARIO_FILE
        if self.path.is_file() or not file.is_file():
            raise KhrError(f'{file}: not there; {ACCEPTED}')
        return read_file(file)

    @property
    def has_scenario(self) -> bool:
        """Return whether the scenario of a khr run is there, in the bag or beside it.

        The bag may be damaged.

        Raises:
            KhrError: if there is no bag, or nothing of it can be read.
        """
        beside = self.path.is_dir() and (self.folder / SCENARIO_FILE).is_file()
        return beside or has_messages(self.path, (SCENARIO,), self._namespace)

    @cached_property
    def scenario(self) -> Scenario:
        """Return the scenario as it ran.

        Raises:
            KhrError: if there is no scenario, or this version of the project cannot read it.
        """
        return parse(self.text, 'its scenario', self.name, self._namespace)

    @property
    def parameters(self) -> Scenario:
        """Return the scenario; one with all defaults if it cannot be read."""
        try:
            return self.scenario
        except KhrError:
            return Scenario('', {})

    @property
    def version(self) -> str:
        """Return the code version that the scenario states; empty if it states none."""
        return version_in(self.text)

    @property
    def made_with(self) -> dict[str, str]:
        """Return the arithmetic and the versions that the scenario states, by name."""
        return versions_in(self.text)

    @cached_property
    def record(self) -> RunRecord:
        """Return the outcome, from ``outcome.json`` or else from the bag.

        Raises:
            KhrError: if there is neither, or the file cannot be read.
        """
        if self.path.is_dir() and ((self.folder / FILE).exists() or not self.has_bag):
            return read_outcome(self.folder)
        return self.recorded_outcome

    @property
    def recorded_outcome(self) -> RunRecord:
        """Return the outcome that is in the bag.

        Raises:
            KhrError: if the bag cannot be read.
        """
        state, judged = self.final_state, None
        for status in self.messages[OUTCOME]:
            with suppress(MalformedError):
                values = {pair.key: pair.value for pair in status.values}
                judged = outcome_of(status.message, values)
        return RunRecord(
            judged=judged,
            trajectory_hash=state.get('trajectory_hash', ''),
            end=state.get('end', ''),
            changes=self.changes,
        )

    @property
    def final_state(self) -> dict[str, str]:
        """Return the simulator's last report by name; empty if the bag has no end of a run."""
        return final_state(self.messages[STATE])

    @cached_property
    def changes(self) -> tuple[Change, ...]:
        """Return the parameters that were set while the run went on."""
        return tuple(changes_in(self.messages[DIAGNOSTICS]))

    @property
    def pushes(self) -> list[Event]:
        """Return the pushes of the scenario and the pushes received over the topic."""
        timed = timed_pushes(self.parameters.table(RunParameters).pushes)
        return [*timed, *map(received_push, self.messages[PUSHED])]

    @cached_property
    def signals(self) -> tuple[Series, Outcome | None]:
        """Return the signals of the bag, and the outcome judged by them.

        Raises:
            KhrError: if there is no bag, it cannot be read, or it holds no signal.
        """
        series, outcome = series_of(self.messages, self.parameters, self.changes)
        if not series.time.size:
            inside = f'namespace {self._namespace}' if self._namespace else 'it'
            raise KhrError(f'{self.path}: no signals in {inside}; accepted: the bag of a khr run')
        return series, outcome

    @cached_property
    def robot(self) -> Robot:
        """Return the description of the robot in the bag, or else the packaged one."""
        found = self.messages.get(ROBOT_DESCRIPTION)
        return Robot(found[-1].data) if found else Robot.load()

    @property
    def series(self) -> Series:
        """Return the signals; those of an offline run, bit for bit, if nothing was lost."""
        return self.signals[0]
