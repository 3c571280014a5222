"""``khr verify``: repeat the run of a bag offline and compare all that both have."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import Progress

from khr_bringup.changes import Change
from khr_bringup.code_version import differences, library_versions, version_of, versions_of_run
from khr_bringup.offline import SIMULATOR, ControlLoop, run_offline
from khr_bringup.recorded.bags import existing_bag
from khr_bringup.recorded.comparison import (
    SideBySide,
    compared_topics,
    differences_beside,
    numbers_of,
)
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.recorded_run import RecordedRun
from khr_bringup.result import Result
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.interfaces import JOINT_STATES, PUSHED, SCENARIO, TRUE_POSE, WORLD, full_name
from khr_common.statuses import is_integer
from khr_sim.physics.truth import GroundTruth
from khr_sim.run_parameters import RunParameters

OF_PUSHES = tuple((SIMULATOR, name) for name in ('push_link', 'push_point', 'push_duration'))


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
