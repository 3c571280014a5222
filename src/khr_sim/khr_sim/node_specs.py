"""Specifications of the nodes of this package."""

from __future__ import annotations

from khr_common.block import NodeSpec
from khr_common.interfaces import (
    ANKLE_CORRECTION,
    DECIDED,
    DIAGNOSTICS,
    HIP_CORRECTION,
    JOINT_REFERENCE,
    JOINT_STATES,
    PUSH,
    PUSHED,
    READY,
    ROBOT_DESCRIPTION,
    STATE,
    TF,
    TF_AVAILABLE,
    TF_STATIC,
    TRUE_POSE,
)
from khr_sim.blocks import FootForceBlock, GyroBlock
from khr_sim.physics.truth import SIGNALS
from khr_sim.run_parameters import RunParameters
from khr_sim.sensors.foot_force import FootForceParameters
from khr_sim.sensors.gyro import GyroParameters
from khr_sim.transforms import TransformsParameters

SIMULATOR = NodeSpec(
    'simulator',
    'khr_sim',
    RunParameters,
    subscribes=(JOINT_REFERENCE, ANKLE_CORRECTION, HIP_CORRECTION, DECIDED, PUSH, READY),
    publishes=(*SIGNALS, ROBOT_DESCRIPTION, STATE, PUSHED, DIAGNOSTICS),
    node='khr_sim.nodes.simulator:SimulatorNode',
)
GYRO = NodeSpec('gyro', 'khr_sim', GyroParameters, GyroBlock)
FOOT_FORCE = NodeSpec('foot_force', 'khr_sim', FootForceParameters, FootForceBlock)
TRANSFORMS = NodeSpec(
    'transforms',
    'khr_sim',
    TransformsParameters,
    subscribes=(TRUE_POSE, JOINT_STATES),
    publishes=(TF, TF_STATIC),
    node='khr_sim.nodes.transforms:TransformsNode',
    joins=lambda table: bool(table.enabled) and TF_AVAILABLE,
)
