"""Scenarios: ROS 2 parameter files, read strictly; the tables of the nodes have the defaults."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from os.path import isdir, isfile
from pathlib import Path
from typing import Any, TypeVar

import yaml

from khr_bringup.node_registry import controllers, node_of, registry, short_name, table_of
from khr_bringup.scenario.control_text import title_of, title_with_changes
from khr_bringup.scenario.derived import derived, without_derived
from khr_bringup.scenario.driver import Driver
from khr_bringup.scenario.motion_file import with_motion
from khr_bringup.scenario.parameter_file import Values, checked, parse_value, values_of
from khr_common import ParameterError, build, specifications
from khr_common.errors import LONGEST, KhrError, named, quoted
from khr_common.interfaces import Topic
from khr_common.strict_yaml import read_file, read_yaml
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.engines import LIBRARIES
from khr_sim.run_parameters import GAIT

WITHOUT_PYBULLET = 'mujoco'  # the engine if PyBullet is not installed
SHORTEST_PREFIX, MOST_OFFERED = 3, 5  # letters, and names of scenarios
ANYWHERE = '/**/'  # in a parameter file, before the name of a node in whatever namespace
CONFIG = Path(str(files('khr_bringup') / 'config'))
SHIPPED = CONFIG / 'scenarios'
Table = TypeVar('Table')


@dataclass(frozen=True)
class Scenario:
    """The parameters of every node of a run."""

    name: str  # the stem of its file
    values: Values  # stated parameters, by node and key; the rest are defaults
    title: str = ''  # the first comment line of its file, and changes from the command line
    driver: Driver | None = None  # in the simulator's place; None for the simulator

    def table(self, table: type[Table]) -> Table:
        """Build the parameter table of the node that it belongs to.

        Raises:
            ParameterError: if a value is not accepted (scenarios read from files are checked).
        """
        return build(table, self.of(node_of(table)))

    def of(self, node: str) -> dict[str, Any]:
        """Return the stated parameters of a node, and those derived from them."""
        return derived(self.values, node) | self.values.get(node, {})

    def whole(self, node: str) -> dict[str, Any]:
        """Return all parameters of a node but its wiring, defaults filled in."""
        known = specifications(table_of(node)).items()
        defaults = {key: each.default for key, each in known if not each.wiring}
        return defaults | self.of(node)

    @property
    def nodes(self) -> list[str]:
        """Return the nodes that take part, in the order in which data flows."""
        joining = [
            name
            for name, node in registry().items()
            if not node.spec.drives and node.spec.joins(build(node.spec.table, self.of(name)))
        ]
        return joining if self.driver is None else self.driver.graph(joining)

    @property
    def answers(self) -> list[str]:
        """Return the nodes that command joints: the gait, then each controller."""
        return [GAIT, *(name for name in self.nodes if name in controllers())]

    @property
    def corrections(self) -> dict[str, Topic]:
        """Return the topic of each controller's correction by short name, ankle and hip first."""
        nodes = self.nodes
        return {short_name(name): topic for name, topic in controllers().items() if name in nodes}

    def changed(self, changes: Mapping[tuple[str, str], Any]) -> Scenario:
        """Return a scenario with values replaced, by (node, key); they are checked.

        Raises:
            KhrError: if a node or key is unknown or a value is not accepted.
        """
        values = {node: dict(keys) for node, keys in self.values.items()}
        if (GAIT, 'motion_file') in changes:  # its frames are read
            values.get(GAIT, {}).pop('frames', None)
        for (node, key), value in changes.items():
            values.setdefault(node, {})[key] = checked(self.name, node, key, value)
        return replace(self, values=_consistent(self.name, values))

    def driven_by(self, driver: Driver) -> Scenario:
        """Return the scenario on a driver in the simulator's place.

        It runs in real time unless the scenario states otherwise.
        """
        if driver.path is None and (node := registry().get(driver.name)):
            table = build(node.spec.table, self.of(driver.name))
            driver = replace(driver, publishes=node.spec.brought(table))
        stated = self.values.get('simulator', {}).get('sync', 'realtime')
        by = 'sensors' if driver.judged_by == 'sensors' else 'truth'
        driven = replace(
            self.changed({('simulator', 'sync'): stated, ('monitor', 'judge_by'): by}),
            title=f'{self.title or self.name}, on {driver.label}'[:LONGEST],
            driver=driver,
        )
        specs = [registry()[node].spec for node in driven.nodes if node != driver.name]
        flows = {*driver.publishes, *(topic for spec in specs for topic in spec.publishes)}
        for spec in specs:
            if spec.block is None:
                continue
            for topic in spec.block(driven.table(spec.table)).needs:
                if topic not in flows:
                    raise KhrError(
                        f'{self.name}: {spec.name} needs the topic {topic.name}, which nobody '
                        f'publishes; accepted: a driver that publishes it, or a scenario without'
                    )
        return driven

    def set_to(
        self, texts: Iterable[str], more: Mapping[tuple[str, str], Any] | None = None
    ) -> Scenario:
        """Return a scenario with changes as on a command line; its title names them.

        Args:
            texts: each ``node.key=value``.
            more: further changes, as of :meth:`changed`, which the title does not name.

        Raises:
            KhrError: as :meth:`changed`, or if a text is not of that form.
        """
        given = list(texts)
        changed = self.changed({**changes_of(given), **(more or {})})
        return replace(changed, title=title_with_changes(changed, given)[:LONGEST].strip())

    def switched_off(self, changes: Iterable[tuple[str, str]]) -> dict[str, list[str]]:
        """Return parameters without effect, by node, because its ``enabled`` is false."""
        found: dict[str, list[str]] = {}
        for node, key in changes:
            switch = specifications(table_of(node)).get('enabled')
            if switch and key != 'enabled' and not self.of(node).get('enabled', switch.default):
                found.setdefault(node, []).append(key)
        return found

    def to_yaml(self) -> str:
        """Write the whole scenario, defaults included, as a ROS 2 parameter file.

        It applies to nodes in any namespace.
        """
        nodes = dict.fromkeys(['simulator', *self.nodes])  # the simulator concerns all
        return self._as_yaml({node: self.whole(node) for node in nodes})

    def stated_to_yaml(self) -> str:
        """Write the stated parameters, those of a motion file included, as :meth:`to_yaml`."""
        return self._as_yaml(self.values)

    def _as_yaml(self, values: Mapping[str, Mapping[str, Any]]) -> str:
        document = {
            ANYWHERE + node: {'ros__parameters': dict(keys)} for node, keys in values.items()
        }
        return f'# {self.title or self.name}\n' + yaml.safe_dump(document, sort_keys=False)


def load_scenario(name: str, sought: str = 'scenario') -> Scenario:
    """Read a scenario by path, or by name from the current config folder or the installed one.

    Args:
        name: path or name.
        sought: the kind of thing that the name may be, for the error text.
    """
    return with_installed_engine(read_scenario(find_scenario(name, sought)))


def with_installed_engine(scenario: Scenario) -> Scenario:
    """Return a scenario on MuJoCo if it names no engine and PyBullet is not installed.

    PyBullet has no wheel for Python 3.12 and later.
    """
    stated = 'engine' in scenario.values.get('simulator', {})
    if stated or _installed(LIBRARIES[SimulatorParameters().engine]):
        return scenario
    _name_the_engine()
    return scenario.changed({('simulator', 'engine'): WITHOUT_PYBULLET})


@cache
def _installed(library: str) -> bool:
    return find_spec(library) is not None


@cache
def _name_the_engine() -> None:
    print(
        'khr: PyBullet is not installed (it has no wheel for this Python): MuJoCo is the engine; '
        '"make bullet" compiles PyBullet',
        file=sys.stderr,
    )


def read_scenario(path: Path) -> Scenario:
    """Read the file of a scenario; the engine stays unstated if the file names none.

    A parameter that equals its derived value in a file with all parameters stays unstated, too.

    Raises:
        KhrError: as :func:`load_scenario`.
    """
    scenario = parse(read_file(path), str(path), path.stem)
    return replace(scenario, values=without_derived(scenario.values))


def parse(text: str, file: str, name: str, namespace: str = '') -> Scenario:
    """Read a scenario from the text of a ROS 2 parameter file.

    Args:
        text: of the file.
        file: its name in error messages.
        name: of the scenario.
        namespace: of the robot, in the file of a bout.

    Raises:
        KhrError: as :func:`load_scenario`.
    """
    values = values_of(read_yaml(text, file), file, namespace)
    return Scenario(name, _consistent(file, values, Path(file).parent), title_of(text))


def find_scenario(name: str, sought: str = 'scenario') -> Path:
    """Return the file of a scenario given by path or name.

    Raises:
        KhrError: if there is no such file, as :func:`load_scenario`.
    """
    for path in (
        Path(name),
        Path('config/scenarios') / f'{name}.yaml',
        SHIPPED / f'{name}.yaml',
        SHIPPED / Path(name).name,
    ):
        if isfile(path):  # Path.is_file raises if the name is too long to be one
            return path
    near = _near(name)
    found = 'a folder, no file' if isdir(name) else f'no such {sought}'
    raise KhrError(
        f'{named(name)}: {found}; '
        + (f'did you mean {near}? ' if near else '')
        + 'accepted: a path, or a name ("khr scenarios" lists them)'
    )


def _near(name: str) -> str:
    """Return the scenarios with the longest common prefix, or else the most similar one."""
    stem, known = Path(name).name.removesuffix('.yaml'), [path.stem for path in shipped()]
    lengths = range(len(stem), SHORTEST_PREFIX - 1, -1)
    begun = ([each for each in known if each.startswith(stem[:length])] for length in lengths)
    alike = next(filter(None, begun), [])
    if not alike or len(alike) > MOST_OFFERED:
        alike = get_close_matches(stem, known, 1)
    return ' or '.join(alike)


def shipped() -> list[Path]:
    """List the scenario files that come with the project."""
    return sorted(SHIPPED.glob('*.yaml'), key=lambda path: _natural(path.stem))


def parse_change(text: str) -> tuple[tuple[str, str], Any]:
    """Read ``node.key=value`` as on a command line."""
    match = re.fullmatch(r'(\w+)\.(\w+)=(.*)', text, re.DOTALL)
    if not match:
        key = text.partition('=')[0]
        having = [f'{node}.{key}' for node in registry() if key in specifications(table_of(node))]
        near = f'did you mean {" or ".join(having)}? ' if having else ''
        raise KhrError(f'{quoted(text)} is not accepted; {near}accepted: node.parameter=value')
    node, key, value = match.groups()
    return (node, key), parse_value(node, key, value)


def _natural(stem: str) -> list[Any]:
    return [
        float(part) if re.fullmatch(r'[\d.]+', part) else part
        for part in re.split(r'(\d+(?:\.\d+)?)', stem)
    ]


def _consistent(file: str, values: Values, folder: Path = Path()) -> Values:
    for node, keys in values.items():
        try:
            build(table_of(node), keys)
        except ParameterError as error:
            raise KhrError(f'{file}: {node}: {error}') from error
    if values.get('stage', {}).get('mode', 'none') == 'none':
        for node in registry():
            if values.get(node, {}).get('staged'):
                raise KhrError(
                    f'{file}: {node}: staged: True is not accepted; accepted: '
                    'False while the mode of stage is none'
                )
    return with_motion(file, values, folder)


def changes_of(texts: Iterable[str]) -> dict[tuple[str, str], Any]:
    """Read several ``node.key=value``."""
    return dict(map(parse_change, texts))
