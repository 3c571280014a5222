"""Prepare a round of a bout for the launch file; this module does not import ``launch``."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import mkdtemp

from khr_bringup.bout.bout import load_bout
from khr_bringup.bout.recorded import folder_of_round, write_scenario
from khr_bringup.bout.running import robots_of
from khr_bringup.graph.launching import SHORT, Launch, nodes_of, split_changes, switch
from khr_bringup.graph.wiring import Wiring
from khr_bringup.run_folder import SCENARIO, claim
from khr_common.errors import KhrError
from khr_common.files import write_text

# Arguments of the launch file that have no meaning for a bout.
OF_A_SCENARIO = ('duration', 'driver', 'board', 'driver_params', 'expect', 'namespace')


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
    bout = load_bout(given['scenario'])
    bout = bout.set_to(changes) if changes else bout
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
    return Launch(
        bout.name, robots, wiring, folder, parameters, nodes_of(robots, record), rviz, verdict
    )
