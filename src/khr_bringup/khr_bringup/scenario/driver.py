"""The driver of a graph, and the nodes that it replaces.

A driver is a node of the registry with ``drives`` in its specification, or any executable of
ROS 2. It takes the simulator's place. Its topics decide the rest: a node is left out if the
driver publishes its output, and the run is judged by the topics there are.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from khr_analysis.outcome import MONITOR, OBSERVED, SENSED
from khr_analysis.run_phase import RUN_PHASE
from khr_bringup.node_registry import controllers, registry, spec_of
from khr_common.block import NodeSpec
from khr_common.errors import KhrError
from khr_common.interfaces import (
    BOARD_CORRECTION,
    CLOCK,
    FOOT_FORCES,
    GYRO,
    JOINT_STATES,
    STATE,
    Topic,
)
from khr_common.strict_yaml import read_file, read_yaml

OF_BOARD = (CLOCK, JOINT_STATES, GYRO, *FOOT_FORCES)  # unless the driver's package states others
STATED = 'khr_drivers.yaml'  # in the share of a package: the topics of its drivers
OF_ROBOT = 'khr_hardware/board'  # the driver of the real robot
SIMULATOR, TRUTH = 'simulator', 'ground_truth/'  # the node, and the prefix of its own topics


@dataclass(frozen=True)
class Driver:
    """A driver in the place of the simulator."""

    # package, name: of its executable; the name also is its node's if it is registered
    package: str
    name: str
    publishes: tuple[Topic, ...] = OF_BOARD  # its topics
    path: Path | None = None  # of the executable; None for a registered node

    @property
    def label(self) -> str:
        """Return the driver as PACKAGE/EXECUTABLE."""
        return f'{self.package}/{self.name}'

    @property
    def reports_state(self) -> bool:
        """Return whether the driver reports start and end of the run."""
        return STATE in self.publishes

    @property
    def first(self) -> str:
        """Return the node that ends the run, as the simulator does."""
        return self.name if self.reports_state else RUN_PHASE.name

    @property
    def judged_by(self) -> str:
        """Return the basis of the monitor's judgement: truth, sensors, nothing."""
        flows = set(self.publishes)
        for spec in map(spec_of, registry()):  # and the outputs of nodes made of them
            if spec.block is not None and set(spec.subscribes) <= flows:
                flows |= set(spec.publishes)
        if flows >= set(OBSERVED):
            return 'truth'
        return 'sensors' if flows >= set(SENSED) else 'nothing'

    def graph(self, nodes: Iterable[str]) -> list[str]:
        """Return the nodes of a run on this driver, given the nodes of a run on the simulator."""
        wanted = {node for node in nodes if not self._replaces(spec_of(node))}
        wanted |= {RUN_PHASE.name} if not self.reports_state else set()
        wanted |= {self.name} if self.path is None else set()
        wanted -= {MONITOR.name} if self.judged_by == 'nothing' else set()
        return [node for node in registry() if node in wanted]

    def _replaces(self, spec: NodeSpec) -> bool:
        """Return whether to leave a node out.

        The driver publishes the node's output itself, or does not publish the ground truth that the
        node needs. A driver that closes the loop itself replaces all controllers: they would close
        it twice.
        """
        if BOARD_CORRECTION in self.publishes and spec.name in controllers():
            return True
        flows = {topic for topic in spec.publishes if topic.flow == 'period'}
        brought = bool(flows) and flows <= set(self.publishes)
        truths = {topic for topic in spec.subscribes if topic.name.startswith(TRUTH)}
        blind = spec.block is not None and not truths <= set(self.publishes)
        return spec.name == SIMULATOR or brought or blind


def driver_of(text: str, option: str) -> Driver:
    """Find a driver, given as PACKAGE/EXECUTABLE."""
    package, _, name = text.partition('/')
    if not (package and name) or '/' in name:
        raise KhrError.refused(option, text, 'PACKAGE/EXECUTABLE')
    node = registry().get(name)
    if node is not None and node.spec.package == package:
        if not node.spec.drives:
            raise KhrError(
                f'{option}: {text} is no driver; accepted: an executable of another package, or a '
                f'node that drives: {", ".join(_registered()) or "none is installed"}'
            )
        return Driver(package, name, node.spec.publishes)
    for prefix in _prefixes():
        path = prefix / 'lib' / package / name
        if path.is_file() and os.access(path, os.X_OK):
            return Driver(package, name, _stated(prefix, package, name), path)
    raise KhrError(
        f'{option}: {text}: no such executable; accepted: PACKAGE/EXECUTABLE of lib/ in '
        f'{":".join(map(str, _prefixes()))}'
    )


def _registered() -> list[str]:
    return [f'{each.spec.package}/{name}' for name, each in registry().items() if each.spec.drives]


def _prefixes() -> list[Path]:
    """Return the prefixes of installed packages: of ROS 2, and of this environment."""
    given = os.environ.get('AMENT_PREFIX_PATH', '').split(':')
    return list(dict.fromkeys(Path(prefix) for prefix in (*given, sys.prefix) if prefix))


def _stated(prefix: Path, package: str, name: str) -> tuple[Topic, ...]:
    """Return the topics that the package of a driver states; the board's topics by default."""
    file = prefix / 'share' / package / STATED
    if not file.is_file():
        return OF_BOARD
    document = read_yaml(read_file(file), str(file))
    body = document.get(name, {'publishes': None}) if isinstance(document, dict) else None
    names = body.get('publishes') if isinstance(body, dict) and len(body) == 1 else ()
    if names is None:
        return OF_BOARD
    known = {topic.name: topic for each in registry().values() for topic in each.spec.publishes}
    if not isinstance(names, list) or not names or not all(each in known for each in names):
        raise KhrError.refused(
            f'{file}: {name}: publishes', names, f'a list of {", ".join(sorted(known))}'
        )
    return tuple(known[each] for each in names)
