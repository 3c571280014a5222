"""Verbs of the controller board: look at one, hold or free its robot, or serve a virtual one."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from math import degrees, isclose
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.live import Live
from rich.table import Table

from khr.cli.tables import print_whole
from khr.cli.verbs.live import RunningDomainOption
from khr.cli.verbs.options import NeededScenario, SetOption
from khr_bringup.scenario import scenario as scenarios
from khr_common import KhrError

if TYPE_CHECKING:
    from khr_hardware.client import Client
    from khr_hardware.joint_map import JointMap

REDRAWN = 0.1  # s between two updates of --watch
PortArgument = Annotated[
    str, typer.Argument(help='Serial port of the board, such as /dev/ttyUSB0.')
]
RunOrPort = Annotated[
    str, typer.Argument(help='Serial port of the board; by default that of the current run.')
]
MapOption = Annotated[
    str,
    typer.Option(
        '--map',
        help="YAML file of servos and AD ports, or khr3hv_forces; the KHR-3HV's by default.",
    ),
]
BaudOption = Annotated[int, typer.Option(help='Baud rate; 0 tries 115200, 625000 and 1250000.')]


def probe(
    port: PortArgument,
    map_: MapOption = '',
    baud: BaudOption = 0,
    watch: Annotated[
        bool, typer.Option('--watch', help='Update AD, gyro and forces until Ctrl-C.')
    ] = False,
) -> None:
    """Read firmware, configuration, battery, servos, trims, mixings and AD; write nothing."""
    from khr_hardware.inspection import describe, inspect

    with _wired(port, baud, map_) as (client, joint_map, rate):
        seen = inspect(client, joint_map)
        print(f'{"line":14}{port} at {rate} baud')
        for name, text in describe(seen, joint_map):
            print(f'{name:14}{text}')
        counts = {key: value for key, value in client.counts.figures().items() if value != '0'}
        print(f'{"counts":14}' + ', '.join(f'{value} {key}' for key, value in counts.items()))
        if watch:
            _watch(client, joint_map)
    raise typer.Exit(1 if seen.missing(joint_map) else 0)


def pose(port: PortArgument, map_: MapOption = '', baud: BaudOption = 0) -> None:
    """Read the angle of every joint and compare it with its range in the URDF; write nothing."""
    from khr_description.robot import JOINTS, Robot
    from khr_hardware.inspection import inspect, torque_of

    with _wired(port, baud, map_) as (client, joint_map, _):
        seen = inspect(client, joint_map)
    table = Table('joint', 'ICS', 'position', 'trim', 'angle, deg', 'range, deg', 'torque')
    for joint, (low, high) in zip(JOINTS, Robot.load().limits(), strict=True):
        servo = joint_map.servos[joint]
        span = f'{degrees(low):.0f} to {degrees(high):.0f}'
        record = seen.records.get(servo.ics)
        if record is None or not record.measured:
            table.add_row(joint, str(servo.ics), 'no answer', '', '', span, '')
            continue
        angle = servo.angle(record.measured)
        outside = '' if low <= angle <= high else ' (outside)'
        table.add_row(
            joint,
            str(servo.ics),
            str(record.measured),
            str(record.trim),
            f'{degrees(angle):.1f}{outside}',
            span,
            torque_of(record),
        )
    print_whole(table)
    raise typer.Exit(1 if seen.missing(joint_map) else 0)


def hold(
    port: RunOrPort = '',
    map_: MapOption = '',
    baud: BaudOption = 0,
    domain: RunningDomainOption = None,
) -> None:
    """Switch the torque on at the present angles (on a stand), or hold the posture in a run.

    With a port, the ROM program and the mixings of the board are stopped first.
    """
    if not port:
        _ask_run('hold', domain)
        return
    from khr_hardware.inspection import hold_pose

    with _wired(port, baud, map_) as (client, joint_map, _):
        hold_pose(client, joint_map)
    print('17 servos hold where they were')


def free(
    port: RunOrPort = '',
    map_: MapOption = '',
    baud: BaudOption = 0,
    domain: RunningDomainOption = None,
) -> None:
    """Switch the torque off: a standing robot falls, and a run that has begun ends."""
    if not port:
        _ask_run('free', domain)
        return
    with _wired(port, baud, map_) as (client, joint_map, _):
        client.free(joint_map.numbers)
    print('17 servos are free')


def start(domain: RunningDomainOption = None) -> None:
    """Let the robot of a run that was started with --board take its stance and begin."""
    _ask_run('start', domain)


def deploy(
    scenario: Annotated[str, NeededScenario],
    port: PortArgument,
    before: Annotated[
        Path, typer.Option(help='File to save the current mixings in, for --undo.')
    ] = Path('board-before.json'),
    undo: Annotated[
        bool, typer.Option('--undo', help='Restore the mixings saved in --before.')
    ] = False,
    map_: MapOption = '',
    baud: BaudOption = 0,
    set_: SetOption = None,
) -> None:
    """Write a scenario's gains into the board's own mixing; the robot stands still meanwhile."""
    from khr_bringup.board_loop import loop_of
    from khr_common.files import write_text
    from khr_common.strict_yaml import read_file, read_yaml
    from khr_hardware import feedback
    from khr_hardware.joint_map import JointMap

    if undo:
        data = read_yaml(read_file(before), str(before))  # JSON is YAML too
        with _connected(port, baud) as (client, _):
            feedback.undo(client, data)
        before.unlink()
        print('the mixings are as they were')
        return
    joint_map = JointMap.load(map_)
    loop = loop_of(scenarios.load_scenario(scenario).set_to(set_ or []), joint_map)
    if before.exists():
        raise KhrError(f'--before: {str(before)!r} is there; accepted: a new file')
    with _connected(port, baud) as (client, _):
        feedback.deploy(
            client,
            joint_map,
            loop,
            keep=lambda held: write_text(before, json.dumps(held)),
            forget=before.unlink,
        )
    for joint, factor in loop.factors.items():
        asked = loop.asked[joint]
        rounded = '' if isclose(asked, factor, abs_tol=1e-3) else f', rounded from {asked:.2f}'
        print(f'{joint:16}{factor} counts per AD step of the gyro{rounded}')
    print(f'{"reference":16}{loop.offset} AD steps off the voltage at rest')
    print('in RAM until the battery is switched off; the same command with --undo takes it back')


def serve(
    scenario: Annotated[str, NeededScenario],
    link: Annotated[
        Path, typer.Option(help='Path of the virtual serial port, such as /tmp/rcb4.')
    ],
    map_: MapOption = '',
    ground: Annotated[
        bool,
        typer.Option(
            '--ground',
            help='The robot stands already, in the stance of the scenario; by default '
            'it hangs in a stand, and is put down once it has taken that stance.',
        ),
    ] = False,
    stepped: Annotated[
        bool,
        typer.Option('--stepped', help='No clock: an output cycle passes with each move command.'),
    ] = False,
    duration: Annotated[
        float, typer.Option(min=0.0, help='Wall seconds to serve; 0 goes on until stopped.')
    ] = 0.0,
    priority: Annotated[
        int,
        typer.Option(
            min=0,
            max=99,
            help='Real-time priority, at most that of ulimit -r; 0 for normal scheduling.',
        ),
    ] = 60,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help='Inject "kind=lost start=2.0 count=3 duration=0.05"; see docs/hardware.md.'
        ),
    ] = None,
    wire: Annotated[
        bool,
        typer.Option(
            '--wire', help='Take the time that a real line and board need for each reply.'
        ),
    ] = False,
    reply_ms: Annotated[
        float, typer.Option(min=0.0, help='With --wire, the time that the board itself takes, ms.')
    ] = 0.72,
    byte_us: Annotated[
        float,
        typer.Option(
            min=0.0, help='With --wire, the further time for each byte that is read, us.'
        ),
    ] = 54.0,
    set_: SetOption = None,
) -> None:
    """Serve a virtual board with the robot of a scenario behind it, until stopped.

    Ctrl-C or SIGTERM (``kill``) stops it; a shell script lets a command in its background (``&``)
    ignore SIGINT.
    """
    from khr_bringup.virtual_robot import virtual_board
    from khr_common.processes import ask_for_real_time
    from khr_hardware.joint_map import JointMap
    from khr_hardware.virtual.server import Fault, Faults, Server, Wire

    chosen = scenarios.load_scenario(scenario).set_to(set_ or [])
    ask_for_real_time(priority)  # a board has a processor of its own
    faults = Faults([Fault.parse(text) for text in fault or []])
    board, robot = virtual_board(chosen, JointMap.load(map_), ground)
    try:
        timing = Wire(reply_ms * 1e-3, byte_us * 1e-6) if wire else None
        with closing(Server(board, link, stepped, faults, wire=timing)) as server:
            where = 'stands on the ground' if ground else 'hangs in a stand'
            print(f'{link}: a virtual RCB-4HV; the robot of {chosen.name} {where}', flush=True)
            with suppress(KeyboardInterrupt):
                server.run(duration)
            print(f'output cycles {server.cycles}, late {server.late}')
    finally:
        robot.close()
    if robot.outcome is None:
        print('the robot was never put down')
        return
    print(f'{robot.outcome.verdict} after {robot.outcome.time:.3f} s on the ground')
    print(f'distance {robot.outcome.distance:.3f} m')
    print(f'trajectory hash {robot.trajectory_hash}')


VERBS = (probe, pose, hold, free, start, deploy, serve)


def _watch(client: Client, joint_map: JointMap) -> None:
    """Show the sensor readings, updated until Ctrl-C."""
    from khr_hardware.inspection import readings

    with Live() as shown, suppress(KeyboardInterrupt):
        while True:
            lines = readings(client.ad(), joint_map)
            shown.update('\n'.join(f'{name:18}{text}' for name, text in lines), refresh=True)
            time.sleep(REDRAWN)


def _ask_run(service: str, domain: int | None) -> None:
    """Call a service of the board of a run; print the run."""
    from khr_bringup.graph.live import call_trigger
    from khr_bringup.graph.run_registry import choose

    run = choose(domain)
    print(f'{run.title}: the board is {call_trigger(f"board/{service}", run.domain)}')


@contextmanager
def _wired(port: str, baud: int, map_: str) -> Iterator[tuple[Client, JointMap, int]]:
    """Yield the client of a board, the map of how its robot is wired, and the rate of the line."""
    from khr_hardware.joint_map import JointMap

    joint_map = JointMap.load(map_)
    with _connected(port, baud) as (client, rate):
        yield client, joint_map, rate


@contextmanager
def _connected(port: str, baud: int) -> Iterator[tuple[Client, int]]:
    """Yield the client of a board, and the rate of the line."""
    from khr_hardware.client import connect

    client, rate = connect(port, baud)
    try:
        yield client, rate
    finally:
        client.close()
