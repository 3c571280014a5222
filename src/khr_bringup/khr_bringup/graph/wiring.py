"""The nodes of a run, of one robot or of several in one world, and their wiring.

The wiring are the parameters that connect the nodes, derived when the run starts. They are no part
of the scenario. Nodes receive them in a second parameter file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from khr_analysis.recorder_parameters import RECORDER
from khr_analysis.referee import REFEREE
from khr_bringup.code_version import as_run
from khr_bringup.node_registry import registry, spec_of, table_of
from khr_bringup.offline import SIMULATOR, duration
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.parameter_file import Values
from khr_bringup.scenario.scenario import ANYWHERE, Scenario
from khr_common import specifications
from khr_common.files import write_text
from khr_common.interfaces import (
    CLOCK,
    DIAGNOSTICS,
    LOG,
    PUSH,
    STATE,
    TF,
    TF_STATIC,
    Topic,
    full_name,
)
from khr_common.strict_yaml import read_file, read_yaml
from khr_sim.run_parameters import RunParameters, robot_line

PARAMETERS = 'parameters.yaml'
WIRING = 'wiring.yaml'
# s of wall time for a node to appear, and for a listener to acknowledge the end: on a loaded
# machine both are slow.
START_TIMEOUT = 30.0
ONCE = (SIMULATOR, RECORDER.name)  # nodes that a run has at its root, whatever its robots
COMMON = (CLOCK, TF, TF_STATIC)  # topics of all robots of a world
Place = tuple[float, ...]  # x and y in m, heading in deg


class Member(NamedTuple):
    """A node of a run, in the namespace of its robot; that is empty at the root."""

    robot: str
    node: str

    @property
    def label(self) -> str:
        """Return its name with the namespace, such as ``red/gait``."""
        return full_name(self.robot, self.node)

    @property
    def entry(self) -> str:
        """Return the argument by which a process runs it; see khr_common.nodes.run."""
        return full_name(self.robot, registry()[self.node].entry)


@dataclass(frozen=True)
class Robots:
    """The robots of a run."""

    scenarios: Mapping[str, Scenario]  # by namespace; that of a robot alone is empty
    text: str  # the parameter file of all nodes
    places: tuple[Place, ...] = ()  # starts of robots in one world, which has a referee

    @staticmethod
    def alone(scenario: Scenario) -> Robots:
        """Return the robot of a scenario."""
        return Robots({'': scenario}, as_run(scenario))

    @property
    def file(self) -> str:
        """Return the name of the parameter file; that of a bout is for one round."""
        return PARAMETERS if self.places else SCENARIO

    @property
    def first(self) -> Scenario:
        """Return the scenario that has the parameters of the nodes at the root."""
        return next(iter(self.scenarios.values()))

    @property
    def remaps(self) -> list[str]:
        """Return the remapping rules of ROS by which robots of one world share topics."""
        return [f'{topic.name}:=/{topic.name}' for topic in COMMON] if self.places else []

    @property
    def answers(self) -> list[str]:
        """Return the nodes that answer each sample."""
        found = [
            Member(robot, node).label
            for robot, scenario in self.scenarios.items()
            for node in scenario.answers
        ]
        return [*found, *([REFEREE.name] if self.places else [])]

    @property
    def lines(self) -> list[str]:
        """Return the parameter ``robots`` of the simulator."""
        return [
            robot_line(robot, place, scenario.table(RunParameters))
            for (robot, scenario), place in zip(self.scenarios.items(), self.places, strict=True)
        ]

    def members(self, record: bool) -> list[Member]:
        """Return the nodes of the run, with or without its recorder."""
        of_robots = [
            Member(robot, node)
            for robot, scenario in self.scenarios.items()
            for node in scenario.nodes
            if record or node != RECORDER.name
        ]
        if not self.places:
            return of_robots
        return [
            Member('', SIMULATOR),
            *(member for member in of_robots if member.node not in ONCE),
            Member('', REFEREE.name),
            *([Member('', RECORDER.name)] if record else []),
        ]

    def publishes(self, member: Member) -> list[Topic]:
        """Return the topics of a node, by their names in the run."""
        found: list[Topic] = []
        for topic in spec_of(member.node).publishes:
            if member.node != SIMULATOR or topic == DIAGNOSTICS:
                found.append(self._in(member.robot, topic))
                continue
            found += [topic] if topic == STATE else []
            found += [self._in(robot, topic) for robot in self.scenarios]
        return list(dict.fromkeys(found))

    def recorded(self) -> list[Topic]:
        """Return the topics to record, without those of a driver."""
        published = [
            topic
            for member in self.members(record=True)
            if not spec_of(member.node).drives
            for topic in self.publishes(member)
        ]
        pushes = [PUSH.under(robot) for robot in self.scenarios]
        return list({topic.name: topic for topic in (*published, *pushes, LOG)}.values())

    @staticmethod
    def _in(robot: str, topic: Topic) -> Topic:
        return topic if topic in COMMON else topic.under(robot)


@dataclass(frozen=True)
class Wiring:
    """The wiring of one run."""

    values: Values  # parameters by node and name

    @staticmethod
    def derive(
        robots: Robots,
        folder: Path,
        record: bool = True,
        endless: bool = False,
        joint_frames: bool = True,
        scenario_file: Path | None = None,
    ) -> Wiring:
        """Derive the wiring of a run.

        Args:
            robots: that run.
            folder: of the run.
            record: whether a recorder takes part.
            endless: whether the run goes on after its motion; else it ends with it.
            joint_frames: whether the node ``transforms`` publishes the frames of the joints.
            scenario_file: to store in the bag; by default that in the folder.
        """
        scenario, members = robots.first, robots.members(record)
        of_run = {
            'answers': robots.answers,
            'listeners': [each.label for each in members if spec_of(each.node).listens],
            'start_timeout': START_TIMEOUT,
            **({} if endless else {'duration': duration(scenario)}),
            **({'robots': robots.lines} if robots.places else {}),
        }
        clocks = dict.fromkeys([SIMULATOR, *([scenario.driver.first] if scenario.driver else [])])
        values = {
            node: {
                name: list(value) if isinstance(value, list) else value  # no YAML aliases
                for name, value in of_run.items()
                if name in specifications(table_of(node))
            }
            for node in clocks
        }
        if not joint_frames:
            values['transforms'] = {'joints': False}
        if record:
            values[RECORDER.name] = {
                'folder': str(folder / 'bag'),
                'scenario_file': str(scenario_file or folder / SCENARIO),
                'topics': [topic.line for topic in _topics(robots)],
            }
        return Wiring(values)

    @staticmethod
    def read(file: Path) -> Wiring:
        """Read the wiring that :meth:`write` has written."""
        document = read_yaml(read_file(file), str(file))
        return Wiring(
            {
                node.removeprefix(ANYWHERE): body['ros__parameters']
                for node, body in document.items()
            }
        )

    def write(self, folder: Path) -> Path:
        """Write the wiring as a ROS 2 parameter file into the folder of a run; return the file."""
        document = {
            ANYWHERE + node: {'ros__parameters': values} for node, values in self.values.items()
        }
        file = folder / WIRING
        write_text(file, yaml.safe_dump(document, sort_keys=False))
        return file

    @property
    def listeners(self) -> tuple[str, ...]:
        """Return the nodes that must receive the whole run."""
        return tuple(self.values[SIMULATOR]['listeners'])

    def driver_parameters(self, scenario: Scenario) -> dict[str, Any]:
        """Return the parameters of the run that a foreign driver receives."""
        table = scenario.table(RunParameters)
        own = self.values[SIMULATOR]
        return {
            'control_period': table.control_period,
            'sync': table.sync,
            'answers': own['answers'],
            'listeners': own['listeners'],
        }


def _topics(robots: Robots) -> list[Topic]:
    """Return the topics to record."""
    driver = robots.first.driver
    published = (*(driver.publishes if driver else ()), *robots.recorded())
    topics = list({topic.name: topic for topic in published}.values())
    if driver and robots.first.table(RunParameters).sync == 'realtime':
        # Other publishers may skip samples, or stamp them by another clock than the driver's.
        return [
            replace(topic, flow='event') if topic.flow == 'period' and topic != CLOCK else topic
            for topic in topics
        ]
    return topics
