"""The wiring of a run: parameters that connect its nodes, derived when it starts.

They are no part of the scenario. Nodes receive them in a second parameter file.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from khr_analysis.recorder_parameters import RECORDER
from khr_bringup.graph.robots import Robots
from khr_bringup.node_registry import spec_of, table_of
from khr_bringup.offline import SIMULATOR, duration
from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario.parameter_file import Values
from khr_bringup.scenario.scenario import ANYWHERE, Scenario
from khr_common import specifications
from khr_common.files import write_text
from khr_common.interfaces import CLOCK, Topic
from khr_common.strict_yaml import read_file, read_yaml
from khr_sim.run_parameters import RunParameters

WIRING = 'wiring.yaml'
# s of wall time for a node to appear, and for a listener to acknowledge the end: on a loaded
# machine both are slow.
START_TIMEOUT = 30.0


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
