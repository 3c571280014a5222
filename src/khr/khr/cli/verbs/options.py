"""Arguments and options that several verbs share."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from shlex import join
from typing import TYPE_CHECKING, Annotated, Any

import typer

from khr_bringup.run_folder import SCENARIO
from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError

if TYPE_CHECKING:
    from khr_sweeps.cluster import Scheduler


def _scenario_names(incomplete: str) -> list[str]:
    """Complete the name of a scenario that comes with the project."""
    return [path.stem for path in scenarios.shipped() if path.stem.startswith(incomplete)]


ScenarioArgument = typer.Argument(
    help='A scenario file or name; without one, they are listed.', autocompletion=_scenario_names
)
NeededScenario = typer.Argument(help='A scenario file or name.', autocompletion=_scenario_names)
DomainOption = Annotated[
    int | None,
    typer.Option(
        '--domain',
        help='ROS domain of the run (1 to 99); the highest free one by default, regardless of '
        'ROS_DOMAIN_ID.',
    ),
]
OfflineOption = Annotated[
    bool, typer.Option('--offline', help='Run without ROS: no topics; the trajectory is the same.')
]
ProcessesChoice = Annotated[
    bool | None,
    typer.Option(
        '--one-process/--processes',
        help='All nodes in one process (the default), or one process each.',
    ),
]
NetworkOption = Annotated[
    bool, typer.Option('--network', help='Let other machines join the graph; off by default.')
]
ViewOption = Annotated[bool, typer.Option('--view', help='Show it in a browser while it runs.')]
PrintRos2Option = Annotated[
    bool,
    typer.Option(
        '--print-ros2', help='Print the ros2 command that starts the same graph; start nothing.'
    ),
]
RecordOption = Annotated[bool, typer.Option('--record/--no-record', help='Write a bag.')]
OutOption = Annotated[
    Path | None, typer.Option(help='Folder of the run or bout; runs/NAME-TIME by default.')
]
TopicOption = Annotated[
    str,
    typer.Option(
        help='Topic of a recording: Imu, JointState, WrenchStamped, Vector3Stamped or Float64; by '
        'default the pitch rate of a khr run, else the only Imu.'
    ),
]
AxisOption = Annotated[
    str,
    typer.Option(help='Axis of the topic: x, y or z (y by default); of a JointState, a joint.'),
]
NamespaceOption = Annotated[
    str, typer.Option(help='Namespace of the robot, in a recording of several.')
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        '--set',
        help='Change a parameter: node.parameter=value; repeatable: the last value of each counts.',
    ),
]
BoutSetOption = Annotated[
    list[str] | None,
    typer.Option(
        '--set',
        help='Change a parameter: node.parameter=value (of one robot of a bout, '
        'red.node.parameter=value); repeatable: the last value of each counts.',
    ),
]
RobotOption = Annotated[
    str,
    typer.Option(
        '--robot',
        help='Constants of another robot: leaning, stiff or a parameter file; values of '
        'the scenario itself take precedence.',
    ),
]
EngineOption = Annotated[str, typer.Option(help='Physics engine: bullet or mujoco.')]
SeedsOption = Annotated[int, typer.Option(help='Number of seeds of each measurement.')]
ToleranceOption = Annotated[float, typer.Option(help='Tolerance of each bisection, in deg.')]
OptimiserSeedOption = Annotated[int, typer.Option(help='Seed of the optimiser.')]
ProcessesOption = Annotated[
    int | None,
    typer.Option(
        '--workers', '--jobs', help='Processes on this machine; one per core by default.'
    ),
]
OwnEngineOption = Annotated[
    str | None,
    typer.Option(help="Physics engine: bullet or mujoco; the scenario's own by default."),
]
AnkleGainOption = Annotated[
    float | None, typer.Option('--ka', help='Ankle gain K_A; 0 switches the controller off.')
]
HipGainOption = Annotated[
    float | None, typer.Option('--kh', help='Hip gain K_H; 0 switches the controller off.')
]
RUNS = Path('runs')
SchedulerOption = Annotated[
    str | None,
    typer.Option(help='Use the workers of a "dask scheduler", tls://HOST:PORT; needs --tls.'),
]
TlsOption = Annotated[
    Path | None, typer.Option(help='Folder of ca.pem, cert.pem and key.pem for --scheduler.')
]
UnauthenticatedOption = Annotated[
    bool,
    typer.Option(
        '--unauthenticated',
        help='Take a --scheduler at tcp://HOST:PORT without --tls: whoever reaches its port runs '
        'code on its workers and here.',
    ),
]


def scheduler_of(address: str | None, tls: Path | None, unauthenticated: bool) -> Scheduler | None:
    """Return the scheduler that the options name, or None.

    Raises:
        KhrError: if the options do not go together, or a credential is missing.
    """
    from khr_sweeps.cluster import Scheduler

    if address is not None:
        return Scheduler(address, tls, unauthenticated)
    if tls is not None or unauthenticated:
        option = '--tls' if tls is not None else '--unauthenticated'
        raise KhrError(f'{option}: not accepted without --scheduler')
    return None


def settings_of(
    texts: Iterable[str] | None, engine: str | None, ka: float | None, kh: float | None
) -> list[str]:
    """Return the texts of ``--set`` with those of ``--engine``, ``--ka`` and ``--kh``."""
    found = [*(texts or [])]
    for node, gain in (('ankle_controller', ka), ('hip_controller', kh)):
        if gain is not None:
            on = gain != 0.0  # the parameter itself refuses negative gains and nan
            found += [f'{node}.gain={gain!r}'] * on + [f'{node}.enabled={str(on).lower()}']
    return found + ([f'simulator.engine={engine}'] if engine is not None else [])


def run_named(name: str) -> Path:
    """Return the folder of a run; ``last`` is the one in ``runs`` that was started last.

    A scenario is written once, at the start; a report or film renews the folder of an old run.

    Raises:
        KhrError: if there is none.
    """
    if name != 'last' or Path(name).exists():
        return Path(name)
    started = [*RUNS.glob(f'*/{SCENARIO}')]
    if not started:
        raise KhrError(f'last: no run in {str(RUNS)!r}; accepted: the folder of a run, or its bag')
    return max(started, key=lambda file: file.stat().st_mtime).parent


def recording_named(name: str) -> Path:
    """Return the folder of a run, as :func:`run_named`; of a bout that of its first round."""
    from khr_bringup.bout.recorded import played

    return played(run_named(name))


def warn_of_switched_off(scenario: Scenario, texts: Iterable[str]) -> None:
    """Warn on stderr of parameters changed by ``--set`` that have no effect, with the reason."""
    off = scenario.switched_off(scenarios.changes_of(texts))
    for node, keys in off.items():
        print(
            f'khr: --set {node}.{", ".join(keys)}: no effect while {node}.enabled is false; '
            f'to switch it on: --set {node}.enabled=true',
            file=sys.stderr,
        )


def refuse_given(options: Iterable[tuple[str, bool, str]]) -> None:
    """Refuse the first option that is given beside others that exclude it.

    Args:
        options: name, whether it is given, and beside what.

    Raises:
        KhrError: naming the option.
    """
    for option, given, why in options:
        if given:
            raise KhrError(f'{option}: not accepted {why}')


def refuse_offline(
    offline: bool,
    one_process: bool | None,
    domain: int | None,
    network: bool,
    more: Iterable[tuple[str, bool, str]] = (),
) -> None:
    """Refuse options of a graph for a run without one.

    Args:
        offline: whether there is none.
        one_process, domain, network: the options.
        more: further options: name, whether it is given, and the part of a graph that is missing.

    Raises:
        KhrError: naming the first option.
    """
    for option, given, lacking in (
        *more,
        ('--one-process', one_process is True, 'no nodes'),
        ('--processes', one_process is False, 'no nodes'),
        ('--domain', domain is not None, 'no topics'),
        ('--network', network, 'no topics'),
    ):
        if offline and given:
            raise KhrError(
                f'{option}: not with --offline, which has {lacking}; accepted: one of them'
            )


def refuse_with_ros2(
    offline: bool, one_process: bool | None, domain: int | None, network: bool, view: bool
) -> None:
    """Refuse options that the command of ``--print-ros2`` cannot carry.

    Raises:
        KhrError: naming the first option.
    """
    for option, given, reason in (
        ('--offline', offline, 'starts a graph'),
        ('--one-process', one_process is True, 'starts one process per node'),
        ('--domain', domain is not None, 'reads ROS_DOMAIN_ID'),
        ('--network', network, 'reads ROS_AUTOMATIC_DISCOVERY_RANGE'),
        ('--view', view, 'has no page'),
    ):
        if given:
            raise KhrError(
                f'{option}: not with --print-ros2: its command {reason}; accepted: one of them'
            )


def ros2_command(scenario: str, settings: Iterable[str], arguments: Mapping[str, str]) -> str:
    """Return the command of ROS 2 that starts the same graph, quoted for a shell.

    Args:
        scenario: its name or file.
        settings: changes of parameters, as ``node.parameter=value``; the last of each counts.
        arguments: of the launch file, by name; empty ones are left out.
    """
    stated = {'set': ','.join(settings), **arguments}
    words = [
        f'scenario:={scenario}',
        *(f'{name}:={value}' for name, value in stated.items() if value),
    ]
    return join(('ros2', 'launch', 'khr_bringup', 'balance.launch.py', *words))


def settings_text(changes: Mapping[tuple[str, str], Any]) -> list[str]:
    """Return changes by node and parameter as ``node.parameter=value``."""
    return [f'{node}.{key}={value}' for (node, key), value in changes.items()]
