"""The stage node: which of the controls may act, by the inclination read back from the feet."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import JointState

from khr_balance.joints import JOINTS
from khr_balance.nodes.instant import FOOT_FORCES, InstantNode
from khr_balance.stage import StageParameters, StagePolicy
from khr_common import cdr
from khr_common.nodes.messages import restamp
from khr_common.nodes.node import LATCHED
from khr_common.nodes.spin import run_node

MEANING = {1: 'no control', 2: 'ankle', 3: 'ankle and hip'}


class StageNode(InstantNode):
    """Answer each sample of feet and joints with ``stage``; tell changes on ``stage/changes``.

    ``stage`` is a JointState, the one standard message that carries named numbers under a stamp,
    which lockstep needs: ``stage`` (1, 2, 3), ``inclination`` (rad), and by the name of each
    controller the share of its correction that acts. ``stage/changes`` is latched and holds one
    status: the stage a run starts in, and every other one from when it is entered.
    """

    def __init__(self) -> None:
        super().__init__('stage', StageParameters)
        self._policy = StagePolicy(self.parameters)
        self._number = 0
        self._answer = JointState(
            name=['stage', 'inclination', 'ankle_controller', 'hip_controller']
        )
        self._output = self.publish_on(JointState, 'stage')
        self._changes = self.publish_on(DiagnosticArray, 'stage/changes', LATCHED)
        self.listen_for({**FOOT_FORCES, 'joint_states': (JointState, _angles)})

    def configure(self, parameters: StageParameters) -> None:
        """Pass changed parameters to the policy."""
        self._policy.configure(parameters)

    def restart(self) -> None:
        """Begin again in the first stage."""
        self._policy.reset()
        self._number = 0

    def compute(self, time: float, heard: Sequence[Any]) -> None:
        """Step the policy."""
        *forces, angles = heard
        self._answer.position = list(map(float, self._policy.update(forces, angles)))

    def send(self, stamp_ns: int) -> None:
        """Publish the stage, and whether it is another one."""
        restamp(self._answer.header.stamp, stamp_ns)
        self._output.publish(self._answer)
        number = int(self._answer.position[0])
        if number != self._number:
            self._tell(number, stamp_ns)

    def _tell(self, number: int, stamp_ns: int) -> None:
        values = {
            'stage': str(number),
            'before': str(self._number or ''),
            'inclination_deg': f'{degrees(self._answer.position[1]):.3f}',
        }
        self._number = number
        change = DiagnosticArray(
            status=[
                DiagnosticStatus(
                    name='stage',
                    message=f'stage {number}: {MEANING[number]}',
                    values=[KeyValue(key=key, value=value) for key, value in values.items()],
                )
            ]
        )
        restamp(change.header.stamp, stamp_ns)
        self._changes.publish(change)


def _angles(joint_states: bytes) -> list[float]:
    names, positions = cdr.joint_positions(joint_states)
    of_name = dict(zip(names, positions, strict=True))
    return [of_name[joint] for joint in JOINTS]


def main() -> int:
    """Run the stage node."""
    return run_node(StageNode)


if __name__ == '__main__':
    raise SystemExit(main())
