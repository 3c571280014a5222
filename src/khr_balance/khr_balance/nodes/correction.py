"""What the two controller nodes share: one correction, sent to the joints of both legs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sensor_msgs.msg import JointState

from khr_common.node import KhrNode, StampJudge, restamp


class CorrectionNode(KhrNode):
    """Publish ``~/correction`` for a pair of joints, stamped as the sample that it answers."""

    def __init__(self, name: str, table: type[Any], joints: tuple[str, str]) -> None:
        super().__init__(name, table)
        self._judge = StampJudge(self.restart)
        self._answer = JointState(name=list(joints), position=[0.0, 0.0])
        self._output = self.publish_on(JointState, '~/correction')

    def restart(self) -> None:
        """Forget the run so far; a controller with memory overrides this."""

    def answer(self, stamp_ns: int, correction: Callable[[float], float]) -> None:
        """Publish ``correction(time)``, computed once per stamp however often it is asked for."""
        if self._judge.is_new(stamp_ns):
            angle = correction(stamp_ns / 1e9)
            restamp(self._answer.header.stamp, stamp_ns)
            self._answer.position = [angle, angle]
        self._output.publish(self._answer)
