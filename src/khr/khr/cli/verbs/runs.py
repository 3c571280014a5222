"""Verbs that run, view and list scenarios."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console

from khr.cli.verbs.options import (
    AnkleGainOption,
    BoutSetOption,
    DomainOption,
    HipGainOption,
    NamespaceOption,
    NetworkOption,
    OutOption,
    OwnEngineOption,
    PrintRos2Option,
    ProcessesChoice,
    RecordOption,
    RobotOption,
    ScenarioArgument,
    SetOption,
    ViewOption,
    recording_named,
    refuse_offline,
    refuse_with_ros2,
    ros2_command,
    settings_of,
    settings_text,
    warn_of_switched_off,
)
from khr_bringup.launching import parameters_of_driver, with_driver
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.expectation import MEANING
from khr_bringup.scenario.robots import missing_constants, on_robot
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError


def start_run(
    scenario: Annotated[str | None, ScenarioArgument] = None,
    duration: Annotated[
        float | None,
        typer.Option(help='Simulated seconds; 0, the default, runs the whole motion.'),
    ] = None,
    realtime: Annotated[
        bool, typer.Option('--realtime', help='Run against the wall clock instead of in lockstep.')
    ] = False,
    offline: Annotated[
        bool,
        typer.Option(
            '--offline', help='Run without ROS: no topics, no bag; the trajectory is the same.'
        ),
    ] = False,
    one_process: ProcessesChoice = None,
    record: RecordOption = True,
    draw: Annotated[
        bool, typer.Option('--draw/--no-draw', help='Draw the recording: overview.png.')
    ] = True,
    out: OutOption = None,
    set_: SetOption = None,
    robot: RobotOption = '',
    ka: AnkleGainOption = None,
    kh: HipGainOption = None,
    engine: OwnEngineOption = None,
    expect: Annotated[str, typer.Option(help=MEANING)] = '',
    domain: DomainOption = None,
    network: NetworkOption = False,
    view: ViewOption = False,
    driver: Annotated[
        str,
        typer.Option(
            metavar='PACKAGE/EXECUTABLE',
            help="Run on this driver in the simulator's place; in real time unless the scenario "
            'states simulator.sync.',
        ),
    ] = '',
    board: Annotated[
        str,
        typer.Option(
            metavar='PORT',
            help='Run on the real robot at this serial port, such as /dev/ttyUSB0; it moves '
            'only after khr board start.',
        ),
    ] = '',
    driver_params: Annotated[str, typer.Option(help='A parameter file for the driver.')] = '',
    print_ros2: PrintRos2Option = False,
) -> None:
    """Run a scenario and keep its recording, outcome and trajectory hash."""
    from khr.cli.run import Options, run_scenario
    from khr_bringup.graph.graph import RunOptions
    from khr_view.viewing import Viewing

    if scenario is None:
        list_scenarios()
        raise KhrError('run: no scenario given; accepted: one of these, or a scenario file')
    changes: dict[tuple[str, str], Any] = {}
    if duration is not None:
        changes['simulator', 'duration'] = duration
    of_graph = (
        ('--realtime', realtime, 'no clock'),
        ('--view', view, 'no topics to look at'),
        ('--driver', bool(driver), 'no topics'),
        ('--board', bool(board), 'no topics'),
    )
    refuse_offline(offline, one_process, domain, network, of_graph)
    if realtime:
        changes['simulator', 'sync'] = 'realtime'
    settings = settings_of(set_, engine, ka, kh)
    loaded = _load(scenario)
    chosen = on_robot(loaded, robot).set_to(settings, changes)
    chosen = with_driver(chosen, driver, board, '--')
    if print_ros2:
        refuse_with_ros2(offline, one_process, domain, network, view)
        constants = missing_constants(loaded, robot) if robot else {}
        arguments = {
            'driver': driver,
            'board': board,
            'driver_params': driver_params,
            'expect': expect,
            'record': '' if record else 'false',
            'out': str(out or ''),
        }
        every = [*settings_text(constants), *settings, *settings_text(changes)]
        print(ros2_command(scenario, every, arguments))
        return
    way = RunOptions(
        offline,
        one_process is not False,
        record,
        domain,
        network,
        driver_parameters=parameters_of_driver(driver_params, '--driver-params', chosen),
    )
    options = Options(way, draw, out, expect, Viewing() if view else None)
    warn_of_switched_off(chosen, settings)
    raise typer.Exit(run_scenario(chosen, options))


def view(
    source: Annotated[
        str,
        typer.Argument(
            help='A scenario or bout (file or name), a recording (folder or bag), or "last".'
        ),
    ],
    against: Annotated[
        Path | None, typer.Option(help='Another run to play back for comparison.')
    ] = None,
    pace: Annotated[
        float | None,
        typer.Option(
            help='Speed: simulated over wall time, 1 by default; 0 is as fast as possible.'
        ),
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help='Simulated seconds; goes on until stopped by default.')
    ] = None,
    host: Annotated[
        str,
        typer.Option(
            help='Address to serve on; if other machines reach it, the printed address has a token.'
        ),
    ] = '127.0.0.1',
    port: Annotated[
        int, typer.Option(help='Port of the page; the first free one from 8090 on by default.')
    ] = 0,
    browser: Annotated[
        bool, typer.Option('--browser/--no-browser', help='Open the page in a browser.')
    ] = True,
    again: Annotated[
        Literal['same', 'next', 'never'],
        typer.Option(
            help='Restart after the end of the motion or a fall, while a browser is connected: '
            'with the same seed, with the next one, or never.'
        ),
    ] = 'same',
    record: RecordOption = True,
    out: OutOption = None,
    set_: BoutSetOption = None,
    robot: RobotOption = '',
    ka: AnkleGainOption = None,
    kh: HipGainOption = None,
    engine: OwnEngineOption = None,
    domain: DomainOption = None,
    namespace: NamespaceOption = '',
) -> None:
    """Run a scenario or bout, or play back a recorded run, in a browser, until Ctrl-C."""
    from khr.cli.run import Options, print_line, view_scenario
    from khr.cli.verbs.bouts import view_bout
    from khr_bringup.bout.bout import is_bout, load_bout
    from khr_bringup.graph.graph import RunOptions
    from khr_bringup.recorded.storage import is_recording
    from khr_view.viewing import Viewing

    source, page = str(recording_named(source)), Viewing(host, port, browser, again)
    if against is not None or Path(source).is_dir() or is_recording(Path(source)):
        for option, stated in (
            ('--ka', ka is not None),
            ('--kh', kh is not None),
            ('--set', bool(set_)),
            ('--robot', bool(robot)),
            ('--engine', engine is not None),
            ('--duration', duration is not None),
            ('--pace', pace is not None),
            ('--no-record', not record),
            ('--out', out is not None),
            ('--domain', domain is not None),
        ):
            if stated:
                raise KhrError(f'{option}: not accepted with a recording; accepted: a scenario')
        from khr_view.playback import play

        both = [Path(source), *([recording_named(str(against))] if against else [])]
        report = partial(print_line, Console(stderr=True))
        raise typer.Exit(play(both, page, report, namespace))
    if namespace:
        raise KhrError(f'--namespace: {source} is no recording; accepted: one of several robots')
    settings = settings_of(set_, engine, ka, kh)
    if is_bout(source):
        for option, given, instead in (
            ('--duration', duration, '--set referee.time_limit=SECONDS'),
            ('--robot', robot or None, '--set'),
        ):
            if given is not None:
                raise KhrError(f'{option}: {given} is not accepted of a bout; accepted: {instead}')
        bout = load_bout(source)
        last = [] if pace is None else [f'simulator.pace={pace!r}']
        paced = bout.set_to(['simulator.pace=1.0', *settings, *last])
        paced = replace(paced, title=bout.set_to(settings).title)
        way = RunOptions(one_process=True, record=record, domain=domain)
        raise typer.Exit(view_bout(paced, way, out, page))
    defaults = {('simulator', 'pace'): 1.0, ('simulator', 'duration'): 0.0}
    of_options = {('simulator', 'pace'): pace, ('simulator', 'duration'): duration}
    explicit = {key: value for key, value in of_options.items() if value is not None}
    way = RunOptions(one_process=True, record=record, domain=domain, stay=True)
    options = Options(way, out=out, view=page)
    chosen = on_robot(scenarios.load_scenario(source, 'run or scenario'), robot)
    chosen = chosen.changed(defaults).set_to(settings, explicit)
    warn_of_switched_off(chosen, settings)
    raise typer.Exit(view_scenario(chosen, options))


def _load(name: str) -> Scenario:
    try:
        return scenarios.load_scenario(name)
    except KhrError as error:
        from khr_bringup.bout.bout import is_bout

        if is_bout(name):
            raise KhrError(f'{name}: a bout; accepted: khr bout {name}') from error
        raise


def list_scenarios() -> None:
    """List the scenarios that come with the project."""
    from khr_bringup.scenario.scenario_table import scenario_table

    Console().print(scenario_table(map(scenarios.load_scenario, map(str, scenarios.shipped()))))


def doctor() -> None:
    """Check the installation and the machine, and advise on problems."""
    from khr.cli.doctor import examine

    raise typer.Exit(examine(Console()))
