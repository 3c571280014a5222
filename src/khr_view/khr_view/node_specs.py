"""The node of this package, as the graph knows it."""

from __future__ import annotations

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
from khr_view.parameters import PageParameters

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
