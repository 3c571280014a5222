"""A robot as an agent: its observation and its action."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, isfinite, nan, pi, radians, sin, tau
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_bringup.node_registry import controllers
from khr_bringup.offline import ControlLoop
from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.checks import integer
from khr_common.interfaces import ANKLE_CORRECTION, GYRO, HIP_CORRECTION, JOINT_REFERENCE, mix
from khr_common.parameters import LARGEST
from khr_description.robot import JOINTS
from khr_sim.physics.truth import GroundTruth

ACTION_SCALE = radians(15.0)  # rad, of an action of 1
GYRO_RANGE, FORCE_RANGE = 35.0, 150.0  # rad/s and N: ten times the robot's weight
REGIONS = ('l_toe', 'l_heel', 'r_toe', 'r_heel')
OBSERVED = {  # name and bound of each value observed
    **{f'gyro_{axis}': GYRO_RANGE for axis in ('roll', 'pitch', 'yaw')},
    **{f'force_{region}': FORCE_RANGE for region in REGIONS},
    **{f'angle_{joint}': pi for joint in JOINTS},
    **{f'correction_{joints}': 1.0 for joints in ('ankle', 'hip')},
    **{f'phase_{part}': 1.0 for part in ('sine', 'cosine')},
}
MOST = np.array(list(OBSERVED.values()), dtype=np.float32)
STILL = [0.0, 0.0]  # the action of no correction
LARGEST_SEED = 2**31  # of an episode

Observation = NDArray[np.float32]


def controllers_of(scenario: Scenario) -> list[str]:
    """Return the controllers of a scenario that an agent takes the place of."""
    return [
        node
        for node in controllers()
        if node in scenario.nodes and 'enabled' in scenario.whole(node)
    ]


def observation_space() -> spaces.Box:
    """Return the space of the values of :data:`OBSERVED`."""
    return spaces.Box(-MOST, MOST)


def action_space() -> spaces.Box:
    """Return the action space, (2,): ankle and hip correction, where 1 is 15 deg."""
    return spaces.Box(-1.0, 1.0, (2,), np.float32)


class Agent:
    """One robot of an episode.

    Args:
        scenario: of the robot.

    Attributes:
        loop: its blocks, from the truth to the reference of the joints.
        action: that was taken last, (2,).
    """

    def __init__(self, scenario: Scenario) -> None:
        self.loop, self.action = ControlLoop(scenario), STILL
        gait = scenario.table(GaitParameters)
        self._turn = self._start = 0.0  # rad/s, and s where the phase is 0
        if gait.cyclic:
            self._turn, self._start = tau / gait.cycle_period, gait_of(gait).cycle(1)[0]

    def act(self, action: Sequence[float] | Observation) -> list[float]:
        """Take an action, clipped to its space; return the target of the 17 joints, rad.

        Raises:
            KhrError: if it is not two finite numbers.
        """
        self.action = clipped(action)
        corrections = [
            dict.fromkeys(topic.names, ACTION_SCALE * share)
            for topic, share in zip((ANKLE_CORRECTION, HIP_CORRECTION), self.action, strict=True)
        ]
        return mix(self.loop.signals[JOINT_REFERENCE], corrections)

    def observation(self, truth: GroundTruth) -> Observation:
        """Return the observation of the last sample, (28,), clipped to its space."""
        turned = self._turn * (truth.stamp_ns * 1e-9 - self._start)
        values = [
            *self.loop.signals[GYRO],
            *self.loop.forces,
            *truth.joint_position.tolist(),
            *self.action,
            sin(turned),
            cos(turned),
        ]
        return np.minimum(np.maximum(np.array(values, np.float32), -MOST), MOST)


def checked_seed(seed: Any) -> int | None:
    """Return the seed of an episode.

    Raises:
        KhrError: if it is neither None nor an integer from 0 up to 64 bits.
    """
    if seed is None:
        return None
    integer('seed', seed, 0, LARGEST)
    return int(seed)


def clipped(action: Sequence[float] | Observation) -> list[float]:
    """Return an action within the action space."""
    try:
        ankle, hip = (float(share) for share in action)
    except (TypeError, ValueError, OverflowError):
        ankle = hip = nan
    if not (isfinite(ankle) and isfinite(hip)):
        raise KhrError.refused('action', action, '2 finite numbers')
    return [max(-1.0, min(1.0, share)) for share in (ankle, hip)]
