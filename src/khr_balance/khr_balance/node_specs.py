"""Specifications of the nodes gait and stage; those of the controllers are in their modules."""

from __future__ import annotations

from khr_balance.blocks import GaitBlock, StageBlock
from khr_balance.gaits.gait_parameters import GaitParameters
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
