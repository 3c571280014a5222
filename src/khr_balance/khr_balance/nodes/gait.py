"""The gait node: the joint reference of every control period, from the simulator's clock."""

from __future__ import annotations

from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from khr_balance.gait import Gait
from khr_balance.gait_parameters import GaitParameters
from khr_balance.joints import JOINTS
from khr_common import KhrError, cdr
from khr_common.cdr import BLANK
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import run_node


class GaitNode(KhrNode):
    """Answer each ``/clock`` with the reference of that instant.

    The clock is heard as a topic and not as a timer: a timer may skip an instant, and lockstep
    needs an answer to each.
    """

    def __init__(self) -> None:
        super().__init__('gait', GaitParameters)
        self._gait = Gait(self.parameters)
        self._output = self.publish_form(
            JointState(name=list(JOINTS), position=[BLANK] * len(JOINTS)), 'joint_reference'
        )
        self.listen_to_bytes(Clock, '/clock', self._on_clock)

    def configure(self, parameters: GaitParameters) -> None:
        """Take changed parameters."""
        self._gait = Gait(parameters)

    def _on_clock(self, message: bytes) -> None:
        stamp_ns = cdr.clock(message)
        try:
            reference = self._gait.reference(stamp_ns / 1e9)
        except KhrError as error:
            self.fail(str(error))
            return
        self._output.fill(stamp_ns, reference)
        self._output.send()


def main() -> int:
    """Run the gait node."""
    return run_node(GaitNode)


if __name__ == '__main__':
    raise SystemExit(main())
