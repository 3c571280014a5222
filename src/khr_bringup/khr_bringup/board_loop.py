"""Parameters of the real robot's driver from a scenario, and the loop on the board itself."""

from __future__ import annotations

from typing import Any

from khr_balance.controllers import ANKLE_CONTROLLER, HIP_CONTROLLER, AnkleControllerParameters
from khr_balance.feedback import BalanceParameters, rate_gain
from khr_bringup.node_registry import controllers, node_of, table_of
from khr_bringup.scenario.scenario import Scenario
from khr_common import build
from khr_common.errors import KhrError
from khr_common.interfaces import BOARD_CORRECTION
from khr_description.robot import DESCRIPTION
from khr_hardware.feedback import BoardLoop, gyro_of
from khr_hardware.joint_map import COUNT, JointMap
from khr_hardware.parameters import BoardParameters
from khr_hardware.protocol.memory import LARGEST_RATIO

CONTROLLERS = (ANKLE_CONTROLLER, HIP_CONTROLLER)


def on_board(scenario: Scenario) -> Scenario:
    """Return a scenario with the parameters of the node ``board``: the URDF, and its own loop."""
    own = scenario.table(BoardParameters)
    values: dict[str, Any] = {'urdf': own.urdf or str(DESCRIPTION)}
    if own.mixing == 'board':
        loop = loop_of(scenario, JointMap.load(own.map))
        ankle, hip = (abs(loop.factors.get(joint, 0)) for joint in BOARD_CORRECTION.names[::2])
        values |= {'ankle_ratio': ankle, 'hip_ratio': hip, 'ad_offset': loop.offset}
    return scenario.changed({(node_of(BoardParameters), key): values[key] for key in values})


def loop_of(scenario: Scenario, joint_map: JointMap) -> BoardLoop:
    """Return the board's own mixing for the gains of a scenario.

    The board has no ``limit_deg``, and rounds gains to whole ratios and ``reference_offset`` to AD
    steps.

    Raises:
        KhrError: if the board does not support the scenario, or the map has no gyro.
    """
    step = gyro_of(joint_map).step
    factors: dict[str, int] = {}
    asked: dict[str, float] = {}
    offsets: dict[str, int] = {}
    for spec in CONTROLLERS:
        own = scenario.table(spec.table)
        if not own.enabled:
            continue
        _check(own, f'{scenario.name}: {spec.name}')
        exact = rate_gain(own.gain * own.gain_unit) * abs(step) / COUNT
        factor = round(exact)
        if factor > LARGEST_RATIO or (exact and not factor):
            raise KhrError(
                f'{scenario.name}: {spec.name}: gain {own.gain:g} is a ratio of {exact:.3f} on '
                f'this board; accepted: 0, or what is rounded to 1 to {LARGEST_RATIO}'
            )
        joints = spec.publishes[0].names
        factors |= dict.fromkeys(joints, factor if step > 0 else -factor)
        asked |= dict.fromkeys(joints, exact if step > 0 else -exact)
        offsets[spec.name] = round(own.reference_offset / step)
    for name in controllers().keys() - {spec.name for spec in CONTROLLERS}:
        if getattr(build(table_of(name), scenario.of(name)), 'enabled', True):
            raise KhrError(
                f'{scenario.name}: {name}: the board cannot do its control; accepted: one that is '
                'not enabled'
            )
    if not factors:
        raise KhrError(
            f'{scenario.name}: no controller is enabled; accepted: ankle or hip with the gyro'
        )
    if len(set(offsets.values())) > 1:
        raise KhrError(
            f'{scenario.name}: reference_offset of {" and ".join(offsets)} differ; accepted: one, '
            'since both read the same port'
        )
    return BoardLoop(factors, next(iter(offsets.values())), asked)


def _check(own: BalanceParameters, where: str) -> None:
    """Refuse settings that the mixing of the board does not support."""
    by_force = isinstance(own, AnkleControllerParameters) and own.source != 'gyro'
    for name, wrong, accepted in (
        ('source', by_force, 'gyro: a servo has two mixings, and the feet four sensors'),
        ('staged', own.staged, 'false'),
        ('reference_amplitude', own.reference_amplitude != 0.0, '0.0'),
        ('lean_deg', own.lean_deg != 0.0, '0.0'),
    ):
        if wrong:
            raise KhrError(
                f'{where}: {name}: {getattr(own, name)!r} cannot be done by the board; '
                f'accepted: {accepted}'
            )
