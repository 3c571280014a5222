"""The folder of a bout: written while it runs, repeated and compared afterwards."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from khr_analysis.referee import RED, ROBOTS
from khr_bringup.bout.bag import RoundBag
from khr_bringup.bout.bout import Bout, is_bout, parse_bout
from khr_bringup.bout.offline import Influences, run_bout
from khr_bringup.bout.result import FILE, BoutResult, Round, write_bout
from khr_bringup.changes import changes_in
from khr_bringup.code_version import as_run, differences, library_versions, version_in, version_of
from khr_bringup.offline import Loops, Truths
from khr_bringup.recorded.bags import read_messages
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.verify import (
    SideBySide,
    compared_topics,
    numbers_of,
    print_influences,
    pushes_in,
)
from khr_bringup.run_folder import SCENARIO
from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_common.interfaces import DIAGNOSTICS, PUSHED
from khr_common.strict_yaml import read_file

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
    write_text(folder / SCENARIO, text)
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
    text = read_file(folder / SCENARIO)
    bout = parse_bout(text, str(folder / SCENARIO), str(ended.get('bout', folder.name)))
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
