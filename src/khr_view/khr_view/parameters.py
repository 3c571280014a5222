"""The parameters of the page, and its node, as the graph knows it."""

from __future__ import annotations

from dataclasses import dataclass

from khr_common import fixed
from khr_common.block import NodeSpec
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    DIAGNOSTICS,
    FOOT_FORCES,
    GYRO,
    HIP_CORRECTION,
    JOINT_STATES,
    PEAKS,
    PUSHED,
    ROBOT_DESCRIPTION,
    SPECTRUM,
    STAGE,
    STATE,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
)


@dataclass(frozen=True)
class PageParameters:
    """The parameter table of the page."""

    host: str = fixed(
        '127.0.0.1',
        'Address that it is served on; one that other machines reach makes a token necessary, '
        'which the printed address holds.',
    )
    port: int = fixed(
        0, 'Port that it is served on; 0 takes the first free one from 8090 on.', '[0, 65535]'
    )
    rate: float = fixed(
        30.0, 'Frames per second of wall time while a browser is connected.', '[1, 60] Hz'
    )


PAGE = NodeSpec(
    'page',
    'khr_view',
    PageParameters,
    subscribes=(
        JOINT_STATES,
        TRUE_POSE,
        TRUE_INCLINATION,
        *TRUE_FORCES,
        GYRO,
        *FOOT_FORCES,
        ANKLE_CORRECTION,
        HIP_CORRECTION,
        STAGE,
        ROBOT_DESCRIPTION,
        STATE,
        DIAGNOSTICS,
        SPECTRUM,
        PEAKS,
        PUSHED,
    ),
    # It publishes pushes on behalf of its reader; the topic belongs to users.
    node='khr_view.nodes.page:PageNode',
    joins=lambda _: False,  # it observes a run, and is no part of it
)
