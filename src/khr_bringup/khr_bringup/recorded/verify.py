"""``khr verify``: repeat the run of a bag offline and compare all that both have."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from khr_analysis.outcome import MonitorParameters
from khr_bringup.changes import Change
from khr_bringup.code_version import differences, library_versions, version_of, versions_of_run
from khr_bringup.node_registry import registry
from khr_bringup.offline import SIMULATOR, ControlLoop, run_offline
from khr_bringup.recorded.bags import Messages, existing_bag
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.result import FILE, Result, read_outcome
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError, cdr
from khr_common.interfaces import (
    JOINT_STATES,
    PUSHED,
    SCENARIO,
    TRUE_POSE,
    WORLD,
    Topic,
    full_name,
)
from khr_common.statuses import is_integer
from khr_sim.physics.truth import SIGNALS, GroundTruth
from khr_sim.run_parameters import RunParameters

OF_PUSHES = tuple((SIMULATOR, name) for name in ('push_link', 'push_point', 'push_duration'))
TAIL_NS = 100_000_000  # of a run that was interrupted: its last answers may not have come
# A run uses only the angles of joint_states and the pose of odom; their speeds are compared too.
_WHOLE = {JOINT_STATES: cdr.joint_motion, TRUE_POSE: cdr.pose_and_twist}


def numbers_of(topic: Topic) -> cdr.Reader:
    """Return the decoder of all numbers of a periodic topic."""
    return _WHOLE.get(topic) or cdr.numbers_of(topic)


def compared_topics() -> tuple[Topic, ...]:
    """Return the topics that can be compared: the truth, and the outputs of the blocks."""
    answers = (
        topic
        for node in registry().values()
        if node.spec.block is not None
        for topic in node.spec.publishes
        if topic.flow == 'period'
    )
    return tuple(dict.fromkeys((*SIGNALS, *answers)))


class SideBySide:
    """Compare periodic topics, number by number.

    Attributes:
        instants: number of compared samples.
        topics: how many of the bag hold samples.
    """

    def __init__(self, signals: Messages) -> None:
        self._samples = {topic: iter(signals[topic]) for topic in signals if len(signals[topic])}
        self._differing: dict[Topic, int] = {}
        self._ended: dict[Topic, int] = {}
        self.instants, self.topics = 0, len(self._samples)

    def take(self, truth: GroundTruth, loop: ControlLoop, *_: object) -> None:
        """Compare the next sample."""
        self.instants += 1
        speeds = truth.speeds()
        for topic, samples in self._samples.items():
            found = next(samples, None)
            if found is None:
                self._ended.setdefault(topic, truth.stamp_ns)
                continue
            numbers = (*loop.signals.get(topic, ()), *speeds.get(topic, ()))
            if found != (truth.stamp_ns, numbers):
                self._differing.setdefault(topic, truth.stamp_ns)

    def differences(self, end_ns: int, interrupted: bool) -> list[str]:
        """Describe the differing topics, each from its first differing sample on; call it last."""
        until = end_ns - TAIL_NS if interrupted else end_ns
        ended = {topic: at for topic, at in self._ended.items() if at <= until}
        beyond = {topic: end_ns for topic, samples in self._samples.items() if next(samples, None)}
        return [
            f'{topic.name}: {what} t = {at / 1e9:.3f} s'
            for what, found in (
                ('differs from', self._differing),
                ('missing from', ended),
                ('goes on after', beyond),
            )
            for topic, at in found.items()
        ]


def differences_beside(folder: Path, scenario: str, hashed: str, repeated: Result) -> list[str]:
    """Describe the differences of the files in the folder of the run.

    Args:
        folder: of the run.
        scenario: its text, as the bag has it.
        hashed: the trajectory hash in the bag.
        repeated: the run, repeated, with a verdict by the truth.
    """
    found = []
    scenarios = sorted(folder.glob('scenario*.yaml'))
    if scenarios and scenario.encode() not in [path.read_bytes() for path in scenarios]:
        found.append(f'{scenarios[-1]}: not the scenario that the bag has')
    path = folder / FILE
    try:
        stored = read_outcome(folder).to_json() if path.exists() else None
        expected: dict[str, Any] = {'trajectory_hash': hashed}
        if repeated.scenario.table(MonitorParameters).judge_by == 'truth':
            expected |= {'verdict': repeated.verdict, **repeated.quantities}
        if stored is not None:
            found += [
                f'{path}: {name}: {stored.get(name)}, by the bag {value}'
                for name, value in expected.items()
                if stored.get(name) != value
            ]
    except KhrError as error:
        found.append(str(error))
    return found


def verify(bag: Path, namespace: str = '') -> int:
    """Repeat the run of a bag, print both trajectory hashes and all that differs.

    Args:
        bag: the bag, or the folder of the run that holds it.
        namespace: of the robot, in a bag of several.

    Returns:
        0 if the repetition gives the bag and the other files of the run.

    Raises:
        KhrError: if it is no bag of a run, or not as it was written, or the run cannot be
            repeated: it ran against the wall clock, or the time at which a push or change acted
            is unknown.
    """
    place = existing_bag(bag)
    unchecked = check_bag(place)
    run = read_recorded(bag, namespace)
    scenario, state = run.scenario, run.final_state
    recorded, end, time_ns = state['trajectory_hash'], state.get('end', ''), int(state['time_ns'])
    pushes = tuple(pushes_in(bag, run.messages[PUSHED], scenario, run.changes))
    if unchecked:
        print(unchecked)
    print(f'scenario {scenario.title}, {time_ns / 1e9:.3f} s, ended by {end}')
    print_influences(run.changes, pushes)
    print(f'recorded {recorded}')
    repeated, comparison = _repeat(run, time_ns / 1e9, pushes)
    print(f'repeated {repeated.trajectory_hash}')
    print(f'compared {comparison.instants} samples of {comparison.topics} topics')
    found = comparison.differences(time_ns, end == 'stopped')
    if bag != place:
        found += differences_beside(bag, run.text, recorded, repeated)
    for line in found:
        print(line)
    same = repeated.trajectory_hash == recorded and not found
    print('same' if same else 'different')
    # versions that should not matter
    if not same and (elsewhere := differences(run.text, versions_of_run(scenario))):
        print(f'made with {elsewhere}')
    return 0 if same else 1


def read_recorded(bag: Path, namespace: str = '') -> RecordedRun:
    """Read the run of a bag, and check that it can be repeated.

    Raises:
        KhrError: if it is no bag, is damaged, has no scenario or end of a run, was made by
            another version of the project, or lacks something that the repetition needs.
    """
    run = RecordedRun(bag, compared_topics(), numbers_of=numbers_of, namespace=namespace)
    messages, state = run.messages, run.final_state
    if not messages[SCENARIO]:
        raise KhrError(f'{bag}: no scenario in it; accepted: the bag of a khr run')
    time_ns = int(text) if is_integer(text := state.get('time_ns', '')) else 0
    if (
        time_ns
        and not state.get('trajectory_hash')
        and state.get('end') in ('duration', 'stopped')
    ):
        raise KhrError(
            f'{bag}: nothing was simulated: it ran on a driver; accepted: the bag of a simulated run'
        )
    if not state.get('trajectory_hash') or time_ns <= 0:
        raise KhrError(
            f'{bag}: its run has no end, or ended before it began; accepted: the '
            'bag of a run that ended or was interrupted'
        )
    _check_scenario(run)
    if run.scenario.table(RunParameters).sync != 'lockstep':
        raise KhrError(
            f'{bag}: the run followed the wall clock, so it cannot be repeated; '
            'accepted: a run in lockstep'
        )
    if not (len(messages[JOINT_STATES]) and len(messages[TRUE_POSE])):
        raise KhrError(
            f'{bag}: neither poses nor joints to compare in it; accepted: a bag with '
            f'{TRUE_POSE.name} and {JOINT_STATES.name}'
        )
    return run


def print_influences(changes: Iterable[Change], pushes: Iterable[str], robot: str = '') -> None:
    """Print the changes and pushes that acted on a run, with the name of the robot in a bout."""
    for each in changes:
        after = 'from the start' if each.after_ns < 0 else f'after t = {each.after_ns / 1e9:.3f} s'
        node = full_name(robot, each.node)
        print(f'changed {node}.{each.parameter} to {each.value} {after}')
    for push in pushes:
        print(f'pushed {robot}{" " * bool(robot)}{push}')


def pushes_in(
    bag: Path, pushed: Iterable[Any], scenario: Scenario, made: Iterable[Change]
) -> Iterable[str]:
    """Yield the pushes that came over their topic as a scenario has them."""
    p = scenario.table(RunParameters)
    for push in pushed:
        if any((each.node, each.parameter) in OF_PUSHES for each in made):
            raise KhrError(
                f'{bag}: the run cannot be repeated: pushes came while '
                f'{" or ".join(name for _, name in OF_PUSHES)} was changed'
            )
        stamp, force = push.header.stamp, push.wrench.force
        frame = push.header.frame_id.rpartition('/')[2]  # without the robot's name
        x, y, z = p.push_point
        yield (
            f't={(stamp.sec * 1_000_000_000 + stamp.nanosec) / 1e9!r} '
            f'duration={p.push_duration!r} link={p.push_link if frame == WORLD else frame} '
            f'frame={frame} force={force.x!r},{force.y!r},{force.z!r} point={x!r},{y!r},{z!r}'
        )


def _check_scenario(run: RecordedRun) -> None:
    """Check the stored scenario: it states every parameter and all versions that made it."""
    title = f'{run.path}: made by another version of the project'
    try:
        scenario = run.scenario
    except KhrError as error:
        raise KhrError(f'{title}: {error}') from error
    for node in scenario.nodes:
        missing = set(scenario.whole(node)) - set(scenario.values.get(node, {}))
        if missing:
            raise KhrError(f'{title}: its scenario does not know {node}.{min(missing)}')
    if other := differences(run.text, library_versions(scenario.table(RunParameters).engine)):
        raise KhrError(
            f'{run.path}: made with {other}; accepted: a recording made with these versions; '
            'others do not repeat bit for bit'
        )
    if run.version and run.version != version_of(scenario):
        raise KhrError(
            f'{title}: its code version is {run.version}, this one is {version_of(scenario)}'
        )


def _repeat(run: RecordedRun, seconds: float, pushes: Iterable[str]) -> tuple[Result, SideBySide]:
    """Run the scenario for its time, with its changes and pushes; compare it with the bag."""
    timed = [text for text in run.scenario.table(RunParameters).pushes if text]
    scenario = run.scenario.changed(
        {(SIMULATOR, 'duration'): seconds, (SIMULATOR, 'pushes'): [*timed, *pushes] or ['']}
    )
    comparison = SideBySide({topic: run.messages[topic] for topic in compared_topics()})
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task('repeating', total=seconds)

        def watch(truth: GroundTruth, loop: ControlLoop, *_: object) -> None:
            comparison.take(truth, loop)
            progress.update(task, completed=truth.stamp_ns / 1e9)

        return run_offline(scenario, watch, run.changes), comparison
