"""What the two controller nodes share: one correction, sent to the joints of both legs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import Any

from sensor_msgs.msg import Imu, JointState

from khr_balance.feedback import FeedbackParameters
from khr_balance.nodes.instant import Inputs, InstantNode
from khr_common import cdr
from khr_common.cdr import BLANK

PITCH_RATE: Inputs = {'imu/data_raw': (Imu, lambda imu: cdr.angular_velocity(imu)[1])}


class CorrectionNode(InstantNode):
    """Publish ``~/correction`` for a pair of joints, stamped as the sample that it answers."""

    parameters: FeedbackParameters

    def __init__(self, name: str, table: type[Any], joints: tuple[str, str]) -> None:
        super().__init__(name, table)
        self._angle = 0.0
        self._output = self.publish_form(
            JointState(name=list(joints), position=[BLANK, BLANK]), '~/correction'
        )

    @abstractmethod
    def correction(self, time: float, measured: Sequence[float], share: float | None) -> float:
        """Return the law's correction, rad, to what the sensors have measured."""

    def listen(self, sensors: Inputs, group: str = '') -> None:
        """Listen to a group of sensors, and to the stage if the controller is staged."""
        stage: Inputs = {'stage': (JointState, self._share)}
        self.listen_for({**sensors, **stage} if self.parameters.staged else sensors, group)

    def _share(self, stage: bytes) -> float:
        return dict(zip(*cdr.joint_positions(stage), strict=True))[self.get_name()]

    def compute(self, time: float, heard: Sequence[Any]) -> None:
        """Step the law."""
        *measured, share = heard if self.parameters.staged else (*heard, None)
        self._angle = self.correction(time, measured, share)

    def send(self, stamp_ns: int) -> None:
        """Publish the correction."""
        self._output.fill(stamp_ns, (self._angle, self._angle))
        self._output.send()
