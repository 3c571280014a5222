"""Bouts: ROS 2 parameter files with a namespace for each robot, read strictly."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, replace
from math import radians
from os.path import isfile
from pathlib import Path
from typing import Any

import yaml

from khr_analysis.outcome import MONITOR
from khr_analysis.recorder_parameters import RECORDER
from khr_analysis.referee import BLUE, RED, ROBOTS, RefereeParameters
from khr_bringup.node_registry import table_of
from khr_bringup.run_folder import SCENARIO as FOLDER_FILE
from khr_bringup.scenario.control_text import last_of_each, title_of
from khr_bringup.scenario.parameter_file import (
    PARAMETERS,
    REFEREE,
    WILDCARDS,
    as_typed,
    blocks_of,
    with_floats,
)
from khr_bringup.scenario.scenario import (
    CONFIG,
    Scenario,
    changes_of,
    parse,
    with_installed_engine,
)
from khr_common import build, specifications
from khr_common.errors import LONGEST, KhrError, meant, named, quoted
from khr_common.strict_yaml import read_file, read_yaml
from khr_sim.physics.body import Start
from khr_sim.run_parameters import OF_ROBOT, RunParameters

SHIPPED = CONFIG / 'bouts'
SIMULATOR = 'simulator'
AT_ROOT = (SIMULATOR, RECORDER.name)  # nodes that the robots share
NEVER_TILTED = 180.0  # deg: the referee ends a round, not the simulator
# Parameters that a bout sets itself, and the ones to change instead; it sets all seeds as well.
SET_INSTEAD = {
    (SIMULATOR, 'duration'): f'{REFEREE}.time_limit',
    (SIMULATOR, 'stop_when_tilted_deg'): f'{REFEREE}.fall_tilt_deg',
    (MONITOR.name, 'fall_tilt_deg'): f'{REFEREE}.fall_tilt_deg',
    (MONITOR.name, 'fall_height'): f'{REFEREE}.fall_height',
    (MONITOR.name, 'fall_time'): f'{REFEREE}.down_time',
}


@dataclass(frozen=True)
class Bout:
    """Two robots and the rules of their bout."""

    name: str  # the stem of its file
    rules: RefereeParameters
    robots: Mapping[str, Scenario]  # red and blue
    title: str = ''  # the first comment line of its file, and changes from the command line

    @property
    def places(self) -> tuple[tuple[float, ...], ...]:
        """Return x and y in m and heading in deg of the start of each robot."""
        return (self.rules.red_start, self.rules.blue_start)

    @property
    def starts(self) -> list[Start]:
        """Return where the robots start."""
        return [Start(x, y, radians(heading)) for x, y, heading in self.places]

    @property
    def engine(self) -> str:
        """Return the physics engine."""
        return self.robots[RED].table(RunParameters).engine

    def in_round(self, number: int) -> dict[str, Scenario]:
        """Return the robots in a round, from 0: no two of a bout have the same seed."""
        first = self.robots[RED].table(RunParameters).seed * self.rules.rounds + number
        return {
            name: scenario.changed(
                {
                    (node, 'seed'): len(ROBOTS) * first + place
                    for node in scenario.nodes
                    if 'seed' in specifications(table_of(node))
                }
            )
            for place, (name, scenario) in enumerate(self.robots.items())
        }

    def set_to(self, texts: Iterable[str]) -> Bout:
        """Return a bout with changes as on a command line.

        Args:
            texts: each ``node.key=value`` for both robots, ``red.node.key=value`` for one, or
                ``referee.key=value``.

        Raises:
            KhrError: if a text is not of that form, a value is not accepted, or the bout sets a
                parameter itself.
        """
        given = list(texts)
        if not given:
            return self
        rules: dict[str, Any] = {}
        own: dict[str, list[str]] = {name: [] for name in ROBOTS}
        for text in given:
            match = re.fullmatch(rf'({"|".join(ROBOTS)})\.(\w+\..*)', text, re.DOTALL)
            chosen, rest = ([match[1]], match[2]) if match else (list(ROBOTS), text)
            if rest.startswith(f'{REFEREE}.'):
                key, _, value = rest.removeprefix(f'{REFEREE}.').partition('=')
                known = specifications(RefereeParameters).get(key)
                rules[key] = as_typed(known, read_yaml(value, rest))
                continue
            for name in chosen:
                own[name].append(rest)
        changes = {name: changes_of(own[name]) for name in ROBOTS}
        for each in changes.values():
            _refuse_own(each)
        robots = {name: robot.changed(changes[name]) for name, robot in self.robots.items()}
        title = ', '.join([self.title or self.name, *last_of_each(given)])[:LONGEST]
        found = _rules(self.name, self._stated_rules | rules)
        return _checked(self.name, replace(self, rules=found, robots=robots, title=title))

    def to_yaml(self) -> str:
        """Write the whole bout, defaults included, as a ROS 2 parameter file."""
        red = self.robots[RED]
        blocks = {f'/{REFEREE}': self._stated_rules} | {
            f'/{node}': _without(red.whole(node), OF_ROBOT)
            for node in AT_ROOT
            if node == SIMULATOR or node in red.nodes
        }
        for name, scenario in self.robots.items():
            simulator = scenario.whole(SIMULATOR)
            blocks[f'/{name}/{SIMULATOR}'] = {key: simulator[key] for key in OF_ROBOT}
            for node in scenario.nodes:
                if node not in AT_ROOT:
                    blocks[f'/{name}/{node}'] = scenario.whole(node)
        # Copied: YAML would write a list that is the same in two places as an alias.
        document = {name: {PARAMETERS: deepcopy(values)} for name, values in blocks.items()}
        return f'# {self.title or self.name}\n' + yaml.safe_dump(document, sort_keys=False)

    @property
    def _stated_rules(self) -> dict[str, Any]:
        values = vars(self.rules).items()
        return {key: list(each) if isinstance(each, tuple) else each for key, each in values}


def shipped_bouts() -> list[Path]:
    """List the bouts that come with the project."""
    return sorted(SHIPPED.glob('*.yaml'))


def is_bout(name: str) -> bool:
    """Return whether a file is that of a bout, which has a referee or a robot's namespace.

    Args:
        name: path of a file, or of a folder with ``scenario.yaml``; or the name of a bout.
    """
    path = Path(name)
    path = path / FOLDER_FILE if path.is_dir() else path
    if not path.is_file():
        return any(each.stem == name for each in shipped_bouts())
    if path.suffix not in ('.yaml', '.yml'):
        return False
    document = read_yaml(read_file(path), str(path))
    spaces = {str(key).strip('/').partition('/')[0] for key in document or ()}
    return isinstance(document, dict) and bool(spaces & {REFEREE, *ROBOTS})


def find_bout(name: str) -> Path:
    """Return the file of a bout given by path or name."""
    for path in (Path(name), Path('config/bouts') / f'{name}.yaml', SHIPPED / f'{name}.yaml'):
        if isfile(path):
            return path
    known = [path.stem for path in shipped_bouts()]
    raise KhrError(
        f'{named(name)}: no such bout; {meant(Path(name).stem, known)}accepted: a path, or '
        f'{", ".join(known)}'
    )


def load_bout(name: str) -> Bout:
    """Read a bout by path or name.

    Raises:
        KhrError: if there is none, or it is not accepted: one line with file, node and value.
    """
    path = find_bout(name)
    return parse_bout(read_file(path), str(path), path.stem)


def parse_bout(text: str, file: str, name: str) -> Bout:
    """Read a bout from the text of a ROS 2 parameter file.

    ``/referee`` has the rules, ``/red/NODE`` and ``/blue/NODE`` the parameters of a robot,
    ``/**/NODE`` those of both.

    Raises:
        KhrError: as :func:`load_bout`; ``file`` is the name in the text.
    """
    document = read_yaml(text, file)
    if not isinstance(document, dict):
        raise KhrError(f'{file}: not a parameter file; accepted: "node: ros__parameters: ..."')
    rules: dict[str, Any] = {}
    accepted = (*ROBOTS, *WILDCARDS, '')
    for node, stated in blocks_of(file, document):
        space, _, own = node.strip('/').rpartition('/')
        if own == REFEREE:
            rules |= stated
        if space not in accepted:
            raise KhrError(
                f'{file}: namespace {named(space)}: no such robot; {meant(space, ROBOTS)}accepted: '
                f'{", ".join(ROBOTS)}, ** for both'
            )
    robots = {robot: with_installed_engine(parse(text, file, robot, robot)) for robot in ROBOTS}
    return _checked(file, Bout(name, _rules(file, rules), robots, title_of(text)))


def _refuse_own(changes: Mapping[tuple[str, str], Any]) -> None:
    """Refuse changes that a bout would overwrite, and name the parameters to change instead."""
    for (node, key), value in changes.items():
        seed = key == 'seed' and node != SIMULATOR
        source = f'{SIMULATOR}.seed' if seed else SET_INSTEAD.get((node, key))
        if source:
            raise KhrError.refused(
                f'{node}.{key}', value, f'{source}, from which it follows in a bout'
            )


def _rules(file: str, values: Mapping[str, Any]) -> RefereeParameters:
    try:
        known = specifications(RefereeParameters)
        typed = {key: with_floats(known.get(key), value) for key, value in values.items()}
        return build(RefereeParameters, typed)
    except KhrError as error:
        raise KhrError(f'{file}: {REFEREE}: {error}') from error


def _checked(file: str, bout: Bout) -> Bout:
    """Return a bout of which the referee alone ends the rounds.

    Both robots state the seed of the bout; that of each robot and round follows from it.
    """
    for node in AT_ROOT:
        red, blue = (bout.robots[robot].table(table_of(node)) for robot in ROBOTS)
        for key in specifications(table_of(node)):
            if (key == 'seed' or key not in OF_ROBOT) and getattr(red, key) != getattr(blue, key):
                raise KhrError(
                    f'{file}: {BLUE}: {node}: {key}: {quoted(getattr(blue, key))} is not '
                    f'accepted; accepted: {quoted(getattr(red, key))}, the value of {RED}: both '
                    'robots share one world'
                )
    follows: dict[tuple[str, str], Any] = {
        (SIMULATOR, 'duration'): bout.rules.time_limit,
        (SIMULATOR, 'stop_when_tilted_deg'): NEVER_TILTED,
        **{(MONITOR.name, key): value for key, value in bout.rules.down.items()},
    }
    return replace(
        bout, robots={name: each.changed(follows) for name, each in bout.robots.items()}
    )


def _without(values: Mapping[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if key not in keys}
