"""The nodes of this package, as the graph knows them."""

from __future__ import annotations

from khr_balance.ankle import AnkleController, AnkleControllerParameters
from khr_balance.blocks import GaitBlock, StageBlock
from khr_balance.gait_parameters import GaitParameters
from khr_balance.hip import HipController, HipControllerParameters
from khr_balance.stage import StageParameters
from khr_common.block import NodeSpec
from khr_common.interfaces import STAGE as STAGE_TOPIC
from khr_common.interfaces import STAGE_CHANGES

PACKAGE = 'khr_balance'

GAIT = NodeSpec('gait', PACKAGE, GaitParameters, GaitBlock)
STAGE = NodeSpec(
    'stage',
    PACKAGE,
    StageParameters,
    StageBlock,
    publishes=(STAGE_TOPIC, STAGE_CHANGES),
    node='khr_balance.nodes.stage:StageNode',
    joins=lambda parameters: parameters.mode != 'none',
)
ANKLE_CONTROLLER = NodeSpec(
    'ankle_controller', PACKAGE, AnkleControllerParameters, AnkleController
)
HIP_CONTROLLER = NodeSpec('hip_controller', PACKAGE, HipControllerParameters, HipController)
