"""The nodes of a run: those of one robot, or those of several robots in one world."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from khr_analysis.recorder_parameters import RECORDER
from khr_analysis.referee import REFEREE
from khr_bringup.code_version import as_run
from khr_bringup.node_registry import registry, spec_of
from khr_bringup.offline import SIMULATOR
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.scenario import Scenario
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
from khr_sim.run_parameters import RunParameters, robot_line

PARAMETERS = 'parameters.yaml'
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

    def recorded(self, record: bool = True) -> list[Topic]:
        """Return the topics to record, without those of a driver."""
        published = [
            topic
            for member in self.members(record)
            if not spec_of(member.node).drives
            for topic in self.publishes(member)
        ]
        pushes = [PUSH.under(robot) for robot in self.scenarios]
        return list({topic.name: topic for topic in (*published, *pushes, LOG)}.values())

    @staticmethod
    def _in(robot: str, topic: Topic) -> Topic:
        return topic if topic in COMMON else topic.under(robot)
