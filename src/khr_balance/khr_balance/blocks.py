"""Gait and stage as blocks of the node graph."""

from __future__ import annotations

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_balance.stage import StageParameters, StagePolicy
from khr_common.block import Block, CoreBlock, Numbers, Signals
from khr_common.interfaces import CLOCK, FOOT_FORCES, JOINT_REFERENCE, JOINT_STATES, STAGE


class GaitBlock(Block[GaitParameters]):
    """Answer each clock message with the joint reference.

    The block subscribes to the clock instead of using a timer: a timer may skip a timestamp, but
    lockstep needs an answer to each.
    """

    subscribes = (CLOCK,)
    publishes = (JOINT_REFERENCE,)

    def __init__(self, parameters: GaitParameters) -> None:
        super().__init__(parameters)
        self.gait = gait_of(parameters)

    def check(self, parameters: GaitParameters) -> None:
        """Plan the motion before the parameters are accepted; raises GaitError."""
        gait_of(parameters)

    def configure(self, parameters: GaitParameters) -> None:
        """Plan the motion again with changed parameters."""
        super().configure(parameters)
        self.gait = gait_of(parameters)

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the 17 joint angles, rad."""
        return (self.gait.reference(time),)


class StageBlock(CoreBlock[StageParameters, StagePolicy]):
    """Answer each sample of foot forces and joint angles with the stage."""

    subscribes = (*FOOT_FORCES, JOINT_STATES)
    publishes = (STAGE,)

    def __init__(self, parameters: StageParameters) -> None:
        super().__init__(parameters, StagePolicy(parameters))

    def update(self, time: float, signals: Signals) -> tuple[Numbers, ...]:
        """Return the stage, the inclination in rad, and the active shares of ankle and hip."""
        forces = [signals[topic][2] for topic in FOOT_FORCES]
        return (tuple(map(float, self.core.update(forces, signals[JOINT_STATES]))),)
