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
    PARAMETER_EVENTS,
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
        PARAMETER_EVENTS,
        PUSHED,
    ),
    # What it sends on the topic push is its reader's, as that topic is the user's.
    node='khr_view.nodes.page:PageNode',
    joins=lambda _: False,  # it looks on at a run, and is no part of it
)
