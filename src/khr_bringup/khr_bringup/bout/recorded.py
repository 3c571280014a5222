"""The folder of a bout: written while it runs, repeated and compared afterwards."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from khr_analysis.outcome_values import values_of
from khr_analysis.recording import Recording
from khr_analysis.referee import RED, ROBOTS
from khr_bringup.bout.bout import Bout, is_bout, parse_bout
from khr_bringup.bout.offline import Influences, run_bout
from khr_bringup.bout.result import FILE, BoutResult, Round, write_bout
from khr_bringup.changes import changes_in
from khr_bringup.code_version import as_run, differences, library_versions, version_in, version_of
from khr_bringup.node_registry import spec_of
from khr_bringup.offline import ControlLoop, Loops, Truths
from khr_bringup.recorded.bags import read_messages
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.verify import (
    SideBySide,
    compared_topics,
    numbers_of,
    print_influences,
    pushes_in,
)
from khr_bringup.run_folder import SCENARIO as SCENARIO_FILE
from khr_common.cdr import MessageTemplate
from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_common.interfaces import DIAGNOSTICS, FINISHED, OUTCOME, PUSHED, SCENARIO, STATE, Topic
from khr_common.nodes.messages import Output, blank_message, serialized, status
from khr_common.strict_yaml import read_file
from khr_description.robot import Robot
from khr_sim.nodes.truth_publisher import TruthPublisher
from khr_sim.physics.truth import GroundTruth

OF_SIMULATOR = replace(DIAGNOSTICS, name=f'/{DIAGNOSTICS.name}')
Show = Callable[[float], object]  # takes the simulated time of the bout so far, s


def record_bout(bout: Bout, folder: Path, record: bool, show: Show = lambda _: None) -> BoutResult:
    """Run a bout; write its scenario, the bag of each round and ``bout.json``.

    Args:
        bout: to run.
        folder: claimed for it.
        record: whether to write bags.
        show: called at each sample.
    """
    text = write_scenario(bout, folder)
    bags: list[RoundBag] = []  # that of the present round

    def watch(number: int, before: float, truths: Truths, loops: Loops) -> None:
        if record and not bags:
            bags.append(RoundBag(bag_of_round(folder, number), bout, text))
        for bag in bags:
            bag.take(truths, loops)
        show(before + truths[RED].stamp_ns / 1e9)

    def ended(_: int, result: Round) -> None:
        if bags:
            bags.pop().close(result)

    try:
        result = run_bout(bout, watch, ended=ended)
    finally:
        for bag in bags:
            bag.close(None)
    write_bout(folder, result)
    return result


def write_scenario(bout: Bout, folder: Path) -> str:
    """Write a bout as it runs, with the versions that it runs with; return the text."""
    text = as_run(bout.robots[ROBOTS[0]], bout.to_yaml())
    write_text(folder / SCENARIO_FILE, text)
    return text


def folder_of_round(folder: Path, number: int) -> Path:
    """Return the folder of a round, from 0, in that of its bout."""
    return folder / f'round_{number + 1}'


def bag_of_round(folder: Path, number: int) -> Path:
    """Return the bag of a round, from 0, in the folder of its bout."""
    return folder_of_round(folder, number) / 'bag'


def bout_of_round(source: Path) -> Path | None:
    """Return the folder of the bout if a source is the folder of a round, or its bag."""
    for folder in (source, *source.parents[:2]):
        if re.fullmatch(r'round_\d+', folder.name) and is_bout(str(folder.parent)):
            return folder.parent
    return None


def played(source: Path) -> Path:
    """Return the folder of the first round if a source is the folder of a bout, else the source."""
    first = folder_of_round(source, 0)
    return first if first.is_dir() else source


def recorded_bout(folder: Path) -> tuple[Bout, dict[str, Any]]:
    """Return a bout as it ran, and the content of its ``bout.json``.

    Raises:
        KhrError: if the folder is not that of a bout, or it ran with another version.
    """
    file = folder / FILE
    try:
        ended = json.loads(file.read_bytes())
        hashes = [each['trajectory_hash'] for each in ended['rounds']]
        if not (hashes and all(isinstance(each, str) for each in hashes)):
            raise ValueError('no rounds in it')
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        text = error.strerror if isinstance(error, OSError) else error
        raise KhrError(f'{file}: {text}; accepted: bout.json of a finished bout') from error
    text = read_file(folder / SCENARIO_FILE)
    bout = parse_bout(text, str(folder / SCENARIO_FILE), str(ended.get('bout', folder.name)))
    red = bout.robots[ROBOTS[0]]
    made, here = version_in(text), version_of(red)
    other = differences(text, library_versions(bout.engine))
    if other or made != here:
        raise KhrError(
            f'{folder}: made with {other or f"code version {made}, here {here}"}; accepted: a '
            'recording made with these versions; others do not repeat bit for bit'
        )
    return bout, ended


def verify_bout(folder: Path, show: Show = lambda _: None) -> int:
    """Repeat a bout, print all that differs from its bags and ``bout.json``.

    Returns:
        0 if nothing does.

    Raises:
        KhrError: as :func:`recorded_bout`, or if a bag is damaged.
    """
    bout, ended = recorded_bout(folder)
    print(f'bout {bout.title or bout.name}')
    sides = _recorded_sides(folder, len(ended['rounds']))

    def watch(number: int, before: float, truths: Truths, loops: Loops) -> None:
        show(before + truths[RED].stamp_ns / 1e9)
        for robot, loop in loops.items():
            if (number, robot) in sides:
                sides[number, robot].take(truths[robot], loop)

    influences = influences_on(bout, folder, len(ended['rounds']))
    for (number, robot), each in influences.items():
        if any(each):
            print(f'round {number + 1}:')
        print_influences(*each, robot)
    result = run_bout(bout, watch, influences)
    repeated = result.to_json()
    found = [
        f'{folder / FILE}: {key}: differs'
        for key in ('winner', 'rounds')
        if ended.get(key) != repeated[key]
    ]
    for number, (before, after) in enumerate(zip(ended['rounds'], result.rounds, strict=False), 1):
        print(f'round {number} recorded {before["trajectory_hash"]}')
        print(f'round {number} repeated {after.trajectory_hash}')
    for (number, robot), side in sides.items():
        where = f'round {number + 1} {robot}'
        print(f'{where}: compared {side.instants} samples of {side.topics} topics')
        end_ns = round(result.rounds[number].decision.time * 1e9) if side.instants else 0
        found += [f'{where}: {each}' for each in side.differences(end_ns, interrupted=False)]
    print('\n'.join([*found, 'different' if found else 'same']))
    return 1 if found else 0


def _recorded_sides(folder: Path, rounds: int) -> dict[tuple[int, str], SideBySide]:
    """Return the bags of a bout for comparison, by round from 0 and robot."""
    found = {}
    for number in range(rounds):
        bag = bag_of_round(folder, number)
        if bag.exists():
            check_bag(bag)
            for robot in ROBOTS:
                messages = read_messages(bag, compared_topics(), numbers_of, robot)
                found[number, robot] = SideBySide(messages)
    return found


def influences_on(bout: Bout, folder: Path, rounds: int) -> dict[tuple[int, str], Influences]:
    """Return the recorded changes and pushes that acted on a bout, by round from 0 and robot.

    Changes of the simulator, which is at the root, are those of both robots.
    """
    found = {}
    for number in range(rounds):
        bag = bag_of_round(folder, number)
        if not bag.exists():
            continue
        for robot, scenario in bout.in_round(number).items():
            messages = read_messages(bag, (DIAGNOSTICS, PUSHED), namespace=robot)
            shared = read_messages(bag, (OF_SIMULATOR,), namespace=robot)[OF_SIMULATOR]
            made = (*changes_in(shared), *changes_in(messages[DIAGNOSTICS]))
            pushes = tuple(pushes_in(bag, messages[PUSHED], scenario, made))
            found[number, robot] = Influences(made, pushes)
    return found


class RoundBag:
    """Write the bag of a round, in a new folder, while it runs, without a graph."""

    def __init__(self, folder: Path, bout: Bout, text: str) -> None:
        self._recording = Recording(folder)
        self._recording.write_text(SCENARIO.name, text, 0)
        self._now_ns = 0
        self._topics: dict[str, list[Topic]] = {}
        self._outputs: dict[tuple[str, Topic], Output] = {}
        self._truths: dict[str, TruthPublisher] = {}
        for number, (robot, scenario) in enumerate(bout.robots.items()):
            self._truths[robot] = TruthPublisher(self, Robot.load().urdf, robot, clock=not number)
            self._truths[robot].describe()
            specs = [spec_of(node) for node in scenario.nodes]
            self._topics[robot] = [
                topic
                for spec in specs
                if spec.block is not None
                for topic in spec.publishes
                if topic.flow == 'period'
            ]
            for topic in self._topics[robot]:
                self._outputs[robot, topic] = self.output(topic.under(robot))

    def take(self, truths: Mapping[str, GroundTruth], loops: Mapping[str, ControlLoop]) -> None:
        """Write a sample."""
        for robot, truth in truths.items():
            self._now_ns = truth.stamp_ns
            self._truths[robot].publish(truth)
            for topic in self._topics[robot]:
                output = self._outputs[robot, topic]
                output.fill(truth.stamp_ns, loops[robot].signals[topic])
                output.send()

    def close(self, ended: Round | None) -> None:
        """Write the end of the round, if it has one, and finish the bag."""
        for robot, outcome in ended.outcomes.items() if ended else ():
            assert ended is not None
            verdict = {name: str(value) for name, value in values_of(outcome).items()}
            self.publisher(OUTCOME.under(robot)).publish(
                status('monitor', outcome.verdict, verdict)
            )
            values = {
                'time_ns': str(self._now_ns),
                'end': ended.decision.reason,
                'trajectory_hash': ended.trajectory_hash,
            }
            self.publisher(STATE.under(robot)).publish(status('simulator', FINISHED, values))
        self._recording.close()

    def publisher(self, topic: Topic) -> Any:
        """Return a publisher of a topic, which is added to the bag."""
        name = f'/{topic.name}'
        self._recording.add_topic(name, topic.kind, topic.flow == 'latched')
        return _Publisher(self, name)

    def output(self, topic: Topic, message: Any = None) -> Output:
        """Return an output of a periodic topic."""
        form = MessageTemplate(serialized(message or blank_message(topic)))
        return Output(self.publisher(topic), form)

    def write(self, name: str, data: bytes) -> None:
        """Write a message at the time of the last sample."""
        self._recording.write(name, data, self._now_ns)


class _Publisher:
    """A publisher of one topic that writes to the bag."""

    def __init__(self, bag: RoundBag, name: str) -> None:
        self._bag, self._name = bag, name

    def publish(self, message: Any) -> None:
        """Write a message, or its bytes."""
        self._bag.write(self._name, message if isinstance(message, bytes) else serialized(message))
