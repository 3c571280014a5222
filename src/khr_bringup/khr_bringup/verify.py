"""``khr verify``: repeat the run of a bag offline and compare the trajectories."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from khr_bringup import scenario as scenarios
from khr_bringup.bags import changes, final_state, read_messages
from khr_bringup.code_version import version_in, version_of
from khr_bringup.errors import BringupError
from khr_bringup.node_registry import table_of
from khr_bringup.offline import run_offline
from khr_bringup.scenario import Scenario
from khr_common import KhrError, specifications
from khr_common.interfaces import PARAMETER_EVENTS, PUSHED, SCENARIO, STATE
from khr_sim.run_parameters import RunParameters


@dataclass(frozen=True)
class Recorded:
    """What a bag says of its run: how to repeat it, and what must come of that.

    Attributes:
        scenario: as it ran, every parameter stated.
        trajectory_hash: SHA-256 in hex.
        time_ns: simulated time at the end.
        end: why it ended: duration, tilted, stopped.
        interventions: what acted on the run besides its scenario, in words.
    """

    scenario: Scenario
    trajectory_hash: str
    time_ns: int
    end: str
    interventions: tuple[str, ...]


def verify(bag: Path) -> int:
    """Repeat the run of a bag, print both trajectory hashes; return 0 if they are the same.

    Args:
        bag: the bag, or the folder of the run that holds it.

    Raises:
        BringupError: if it is no readable bag of a run, or the run does not follow from its
            scenario alone: it was changed from outside, or ran against the wall clock.
    """
    recorded = read(bag)
    if recorded.scenario.table(RunParameters).sync != 'lockstep':
        raise BringupError(
            f'{bag}: the run followed the wall clock, so it cannot be repeated; '
            'accepted: a run in lockstep'
        )
    if recorded.interventions:
        raise BringupError(
            f'{bag}: the run cannot be repeated from its scenario alone; while it '
            f'ran: {"; ".join(recorded.interventions)}'
        )
    repeated = _repeat(recorded)
    same = repeated == recorded.trajectory_hash
    print(
        f'scenario {recorded.scenario.title}, {recorded.time_ns / 1e9:.3f} s, '
        f'ended by {recorded.end}'
    )
    print(f'recorded {recorded.trajectory_hash}')
    print(f'repeated {repeated}')
    print('same' if same else 'different')
    return 0 if same else 1


def read(bag: Path) -> Recorded:
    """Read what a bag says of its run.

    Raises:
        BringupError: if it is no bag, is damaged, has no scenario or end of a run, or was made
            by another version of the project.
    """
    messages = read_messages(bag, (SCENARIO, STATE, PARAMETER_EVENTS, PUSHED))
    if not messages[SCENARIO]:
        raise BringupError(f'{bag}: no scenario in it; accepted: the bag of a khr run')
    state = final_state(messages[STATE])
    if not state.get('trajectory_hash') or not int(state.get('time_ns', 0)):
        raise BringupError(
            f'{bag}: its run has no end, or ended before it began; accepted: the '
            'bag of a run that ended or was interrupted'
        )
    return Recorded(
        _scenario(bag, messages[SCENARIO][-1].data),
        state['trajectory_hash'],
        int(state['time_ns']),
        state.get('end', ''),
        tuple(
            f'{each.node}.{each.parameter} was set to {each.value}'
            for each in changes(messages[PARAMETER_EVENTS])
        )
        + (('a push over its topic',) if messages[PUSHED] else ()),
    )


def _scenario(bag: Path, text: str) -> Scenario:
    """Read the stored scenario; it states every parameter of the version that wrote it."""
    title = f'{bag}: made by another version of the project'
    recorded = version_in(text)
    try:
        scenario = scenarios.parse(text, 'its scenario', bag.name)
    except KhrError as error:
        raise BringupError(f'{title}: {error}') from error
    for node in scenario.nodes:
        missing = set(specifications(table_of(node))) - set(scenario.values.get(node, {}))
        if missing:
            raise BringupError(f'{title}: its scenario does not know {node}.{min(missing)}')
    if recorded and recorded != version_of(scenario):
        raise BringupError(
            f'{title}: its code version is {recorded}, this one is {version_of(scenario)}'
        )
    return scenario


def _repeat(recorded: Recorded) -> str:
    """Run the scenario for the time it ran; return the trajectory hash."""
    seconds = recorded.time_ns / 1e9
    scenario = recorded.scenario.changed({('simulator', 'duration'): seconds})
    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task('repeating', total=seconds)
        return run_offline(
            scenario, lambda truth, *_: progress.update(task, completed=truth.stamp_ns / 1e9)
        ).trajectory_hash
