"""The arguments of the launch file; this module does not import ``launch``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import mkdtemp

from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.recorded import folder_of_round, write_scenario
from khr_bringup.graph.wiring import Robots, Wiring
from khr_bringup.node_registry import spec_of
from khr_bringup.run_folder import SCENARIO, claim
from khr_bringup.running import robots_of
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.driver import OF_ROBOT, driver_of
from khr_bringup.scenario.expectation import MEANING, Expectation
from khr_bringup.scenario.scenario import Scenario
from khr_common.errors import KhrError, meant, named
from khr_common.files import write_text

# The launch file's arguments: default and meaning of each.
ARGUMENTS = {
    'scenario': ('walk_7.68deg_ka12', 'A scenario of khr_bringup/config, or a file.'),
    'duration': ('', 'Simulated seconds; the length of the motion by default.'),
    'sync': ('', 'lockstep or realtime; that of the scenario by default.'),
    'realtime_factor': ('', 'Simulated by wall time with sync:=realtime.'),
    'seed': ('', 'Seed of all that is drawn at random; that of the scenario by default.'),
    'driver': (
        '',
        'PACKAGE/EXECUTABLE of a driver in the place of the simulator; in real time unless sync '
        'says otherwise.',
    ),
    'board': ('', 'Serial line of the real robot, such as /dev/ttyUSB0: its driver drives.'),
    'driver_params': ('', 'A parameter file for the driver.'),
    'set': ('', 'Further changes: node.parameter=value,node.parameter=value'),
    'expect': ('', MEANING),
    'record': ('true', 'Write a bag.'),
    'out': ('', 'Folder of the run, new or empty; a temporary one by default.'),
    'namespace': ('', 'Namespace of all nodes, for a second robot.'),
    'rviz': ('false', 'Show the robot in RViz, if it is installed.'),
}
SIMILAR = 0.8  # of 1: a name that differs by a letter or two
# Arguments that stand for a parameter of the simulator.
SHORT = ('duration', 'sync', 'realtime_factor', 'seed')
# Arguments of the launch file that have no meaning for a bout.
OF_A_SCENARIO = ('duration', 'driver', 'board', 'driver_params', 'expect', 'namespace')


@dataclass(frozen=True)
class Launch:
    """A launch that is ready to start."""

    name: str  # of the scenario or bout
    robots: Robots  # of the run
    wiring: Wiring  # of the run
    folder: Path  # of the run
    parameters: tuple[Path, ...]  # the parameter files of all nodes
    record: bool  # whether a recorder takes part
    rviz: bool  # whether to show the robot
    verdict: tuple[str, ...]  # the executable that waits for the end, and its arguments
    driver_parameters: Path | None = None  # a parameter file for the driver, if one is given

    @property
    def scenario(self) -> Scenario:
        """Return the scenario of the run, of a bout that of its first robot."""
        return self.robots.first

    @property
    def nodes(self) -> list[tuple[str, str, str]]:
        """Return package, name and robot of each node."""
        return [
            (spec_of(each.node).package, each.node, each.robot)
            for each in self.robots.members(self.record)
        ]

    @property
    def remappings(self) -> list[tuple[str, str]]:
        """Return the names of topics that robots of one world share."""
        return [
            (old, new) for old, _, new in (rule.partition(':=') for rule in self.robots.remaps)
        ]


def prepare_launch(given: Mapping[str, str], joints: bool = True) -> Launch:
    """Claim the folder of a launch and write its parameter files.

    Args:
        given: the launch file's arguments.
        joints: whether the node ``transforms`` is to publish the joints' frames.
    """
    record, rviz = (switch(name, given[name]) for name in ('record', 'rviz'))
    short = [f'simulator.{name}={given[name]}' for name in SHORT if given[name]]
    scenario = scenarios.load_scenario(given['scenario']).set_to(
        split_changes(given['set']), scenarios.changes_of(short)
    )
    scenario = with_driver(scenario, given['driver'], given['board'])
    driver_parameters = parameters_of_driver(given['driver_params'], 'driver_params', scenario)
    Expectation.parse(given['expect'], 'expect', scenario)  # refused before anything starts
    out = given['out'] or mkdtemp(prefix=f'{scenario.name}-')
    folder = claim(Path(out).absolute(), 'out')
    robots = Robots.alone(scenario)
    wiring = Wiring.derive(robots, folder, record, joint_frames=joints)
    parameters = folder / SCENARIO, wiring.write(folder)
    write_text(parameters[0], robots.text)
    driven = ('--driver', scenario.driver.label) if scenario.driver else ()
    expected = ('--expect', given['expect']) if given['expect'] else ()
    verdict = (
        *('verdict', str(parameters[0]), '--name', scenario.name, '--out', str(folder)),
        *(*expected, *driven),
    )
    return Launch(
        scenario.name, robots, wiring, folder, parameters, record, rviz, verdict, driver_parameters
    )


def prepare_bout(given: Mapping[str, str], joints: bool = True) -> Launch:
    """Claim the folder of a bout that is launched, and write the parameter files of its round.

    Args:
        given: the launch file's arguments.
        joints: whether the nodes ``transforms`` are to publish the joints' frames.
    """
    record, rviz = (switch(name, given[name]) for name in ('record', 'rviz'))
    for name in OF_A_SCENARIO:
        if given[name]:
            raise KhrError(f'{name}: {given[name]!r} is not accepted of a bout; accepted: nothing')
    short = [f'simulator.{name}={given[name]}' for name in SHORT if given[name]]
    changes = [*split_changes(given['set']), *short]
    bout = load_bout(given['scenario']).set_to(changes)
    if bout.rules.rounds > 1:
        raise KhrError(
            f'referee.rounds: {bout.rules.rounds} is not accepted: a launch is one round; '
            'accepted: 1, or khr bout'
        )
    folder = claim(Path(given['out'] or mkdtemp(prefix=f'{bout.name}-')).absolute(), 'out')
    write_scenario(bout, folder)
    own, robots = folder_of_round(folder, 0), robots_of(bout, 0)
    own.mkdir(mode=0o700)
    wiring = Wiring.derive(
        robots, own, record, joint_frames=joints, scenario_file=folder / SCENARIO
    )
    parameters = own / robots.file, wiring.write(own)
    write_text(parameters[0], robots.text)
    verdict = ('verdict', str(folder / SCENARIO), '--name', bout.name)
    return Launch(bout.name, robots, wiring, folder, parameters, record, rviz, verdict)


def with_driver(scenario: Scenario, driver: str, board: str, dashes: str = '') -> Scenario:
    """Return the scenario on a driver or on the real robot; unchanged if neither is given.

    Args:
        scenario: to run.
        driver: PACKAGE/EXECUTABLE; empty for the simulator.
        board: serial line of the real robot; empty without one.
        dashes: prefix of these options.

    Raises:
        KhrError: if both are asked for, there is no such driver, or the scenario cannot run on it.
    """
    if board:
        if driver:
            raise KhrError(f'{dashes}board: not with {dashes}driver; accepted: one of them')
        driver, scenario = OF_ROBOT, scenario.changed({('board', 'port'): board})
    if driver == OF_ROBOT:
        from khr_bringup.board_loop import on_board

        scenario = on_board(scenario)
    return scenario.driven_by(driver_of(driver, f'{dashes}driver')) if driver else scenario


def parameters_of_driver(file: str, option: str, scenario: Scenario) -> Path | None:
    """Return the parameter file of a driver, if one is given.

    Raises:
        KhrError: if there is no such file, or no driver to read it.
    """
    if not file:
        return None
    if scenario.driver is None or scenario.driver.path is None:
        raise KhrError(
            f'{option}: {file!r} is not accepted: no executable of another package drives; '
            'accepted: with driver PACKAGE/EXECUTABLE, or changes of the scenario'
        )
    if not Path(file).is_file():
        raise KhrError(f'{option}: {file!r}: no such file; accepted: a ROS 2 parameter file')
    return Path(file).absolute()


def check_names(given: Iterable[str], asked: Iterable[str]) -> list[str]:
    """Return the command-line arguments that the launch file does not declare.

    Args:
        given: all names, also those of a launch file that includes this one.
        asked: those of the command line.
    """
    for name in given:
        near = meant(name, ARGUMENTS, SIMILAR)
        if near and name not in ARGUMENTS:
            raise KhrError(
                f'{named(name)}: no such argument; {near}accepted: {", ".join(ARGUMENTS)}'
            )
    return [name for name in asked if name not in ARGUMENTS]


def switch(name: str, text: str) -> bool:
    """Read an argument that is true or false."""
    if text.lower() not in ('true', 'false'):
        raise KhrError.refused(name, text, 'true | false')
    return text.lower() == 'true'


def split_changes(text: str) -> list[str]:
    """Split a list of changes at its commas; a value may contain commas."""
    return [part for part in re.split(r',(?=\s*[\w.]+\.\w+=)', text) if part.strip()]
