"""Gait and stage as blocks of the node graph."""

from __future__ import annotations

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.stage import StageParameters, StagePolicy
from khr_common.block import Block, CoreBlock, Numbers, Signals
from khr_common.interfaces import CLOCK, FOOT_FORCES, JOINT_REFERENCE, JOINT_STATES, STAGE


class GaitBlock(Block[GaitParameters]):
    """Answer each instant of the clock with the reference of the joints.

    The clock is a topic here and not a timer: a timer may skip an instant, and lockstep needs an
    answer to each.
    """

    subscribes = (CLOCK,)
    publishes = (JOINT_REFERENCE,)

    def __init__(self, parameters: GaitParameters) -> None:
        super().__init__(parameters)
        self.gait = gait_of(parameters)

    def configure(self, parameters: GaitParameters) -> None:
        """Plan the motion anew."""
        super().configure(parameters)
        self.gait = gait_of(parameters)

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Answer with the 17 joint angles, rad."""
        return (self.gait.reference(time),)


class StageBlock(CoreBlock[StageParameters, StagePolicy]):
    """Answer each sample of feet and joints with the stage of the control."""

    subscribes = (*FOOT_FORCES, JOINT_STATES)
    publishes = (STAGE,)

    def __init__(self, parameters: StageParameters) -> None:
        super().__init__(parameters, StagePolicy(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Answer with the stage, the inclination in rad, and the shares that act."""
        forces = [signals[topic][2] for topic in FOOT_FORCES]
        return (tuple(map(float, self.core.update(forces, signals[JOINT_STATES]))),)
