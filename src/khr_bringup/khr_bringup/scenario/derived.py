"""Parameters that follow from others unless a scenario states them itself."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from copy import copy
from functools import cache
from math import degrees
from typing import Any

from khr_analysis.outcome import MONITOR
from khr_analysis.run_phase import RUN_PHASE
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.gaits.gait_plan import plan_motion
from khr_bringup.node_registry import spec_of, table_of
from khr_common import build, specifications
from khr_common.errors import KhrError
from khr_sim.physics.world import TILTING_SPEED
from khr_sim.run_parameters import GAIT

SHARED = (
    'control_period',
    'seed',
)  # values of the simulator, shared by every node with the parameter
SETTLING = 2.0  # s on the inclined slope before the robot lifts a leg

PEAKS_PER_CYCLE = 4  # of the pitch rate: f_0 = 4/T
# Parameters that follow from the period of the gait, by node.
OF_CYCLE: dict[str, dict[str, Callable[[float], float]]] = {
    GAIT: {'cycle_period': lambda period: period},
    'fft_analyser': {
        'window_length': lambda period: period,  # so every line of the gait has its own bin
        'fundamental': lambda period: PEAKS_PER_CYCLE / period,
    },
    **{
        node: {'reference_frequency': lambda period: PEAKS_PER_CYCLE / period}
        for node in ('ankle_controller', 'hip_controller')
    },
}

Values = Mapping[str, Mapping[str, Any]]


def derived(values: Values, node: str) -> dict[str, Any]:
    """Return the derived parameters of a node, by key.

    All nodes share the simulator's control period and seed; a driver inherits every simulator
    parameter that it declares. The analyser's window is one gait cycle, and f_0 is four times its
    frequency; the cycle of a motion from a file is its repeated part. A leg lift or a motion from
    a file that begins on level ground starts when the slope has reached its inclination and the
    robot is at rest. The monitor averages until the motion ends.
    """
    simulator, known = values.get('simulator', {}), specifications(table_of(node))
    in_its_place = node == RUN_PHASE.name or spec_of(node).drives
    shared = simulator if in_its_place else SHARED
    # Copied: YAML would write a list that is the same in two places as an alias.
    found = {key: copy(simulator[key]) for key in shared if key in simulator and key in known}
    if period := _cycle_period(values.get(GAIT, {})):
        follows = OF_CYCLE.get(node, {})
        found |= {key: rule(period) for key, rule in follows.items()}
    motion = values.get(node, {}).get('motion')
    if motion in ('leg_lift', 'file') and simulator.get('level_start'):
        found['start_delay'] = start_of_lift(simulator.get('inclination_deg', 0.0))
    if node == MONITOR.name:
        try:
            own = derived(values, GAIT) | dict(values.get(GAIT, {}))
            found['motion_end'] = motion_end(build(GaitParameters, own))
        except KhrError:  # a gait that is not accepted is reported for itself
            pass
    return found


def without_derived(values: Values) -> dict[str, dict[str, Any]]:
    """Return stated parameters without the derived ones of nodes of which all are stated.

    So a file with all parameters of a scenario, as a run's folder has it, follows a change of
    seed, gait or control period as the scenario that it was written from.
    """
    return {
        node: {key: value for key, value in keys.items() if not _follows(values, node, key)}
        if _is_whole(node, keys)
        else dict(keys)
        for node, keys in values.items()
    }


def _is_whole(node: str, keys: Mapping[str, Any]) -> bool:
    """Return whether all parameters of a node but its wiring are stated."""
    return all(each.wiring or key in keys for key, each in specifications(table_of(node)).items())


def _follows(values: Values, node: str, key: str) -> bool:
    """Return whether a stated parameter equals the value that it would have if it were not."""
    rest = {name: each for name, each in values[node].items() if name != key}
    found = derived({**values, node: rest}, node)
    return key in found and bool(found[key] == values[node][key])


def _cycle_period(gait: Mapping[str, Any]) -> float | None:
    """Return the stated period of the gait, or that of the repeated part of a file, in s."""
    start, end = gait.get('repeat', (0.0, 0.0))
    known = specifications(GaitParameters)['cycle_period']
    if 'cycle_period' in gait or gait.get('motion') != 'file':
        return gait.get('cycle_period')
    return end - start if (known.minimum or 0.0) <= end - start <= (known.maximum or 0.0) else None


@cache
def motion_end(gait: GaitParameters) -> float:
    """Return when the motion of a gait ends, in s; 0 for a robot that only stands.

    Raises:
        KhrError: if the motion cannot be planned.
    """
    return 0.0 if gait.motion == 'stand' else round(plan_motion(gait).duration, 6)


@cache
def swings(gait: GaitParameters) -> dict[str, list[tuple[float, float]]]:
    """Return when each foot is planned to be in the air, s, by ``left`` and ``right``."""
    try:
        plan = plan_motion(gait)
    except KhrError:  # not within reach
        return {}
    return {name: plan.swings(name[0]) for name in ('left', 'right')}


def start_of_lift(inclination_deg: float) -> float:
    """Return when a leg lift begins that starts on level ground, in s."""
    return round(abs(inclination_deg) / degrees(TILTING_SPEED) + SETTLING, 6)
