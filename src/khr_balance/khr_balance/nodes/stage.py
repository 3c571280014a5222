"""The stage node: which of the controls may act, by the inclination read back from the feet."""

from __future__ import annotations

from math import degrees

from diagnostic_msgs.msg import DiagnosticArray

from khr_common.block import NodeSpec, Numbers
from khr_common.interfaces import STAGE_CHANGES
from khr_common.nodes.block_node import BlockNode
from khr_common.nodes.messages import restamp, status

MEANING = {1: 'no control', 2: 'ankle', 3: 'ankle and hip'}


class StageNode(BlockNode):
    """Answer with ``stage``, and publish each stage that is entered on ``stage/changes``.

    ``stage/changes`` is latched: the stage that a run starts in, and every other one from when it
    is entered.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._number = 0
        self._changes = self.publisher(STAGE_CHANGES)

    def restart(self) -> None:
        """Begin again in the first stage."""
        super().restart()
        self._number = 0

    def answered(self, stamp_ns: int, answer: tuple[Numbers, ...]) -> None:
        """Publish the stage if it is another one."""
        number = int(answer[0][0])
        if number != self._number:
            self._publish_change(number, answer[0][1], stamp_ns)

    def _publish_change(self, number: int, inclination: float, stamp_ns: int) -> None:
        values = {
            'stage': str(number),
            'before': str(self._number or ''),
            'inclination_deg': f'{degrees(inclination):.3f}',
        }
        self._number = number
        change = DiagnosticArray(
            status=[status('stage', f'stage {number}: {MEANING[number]}', values)]
        )
        restamp(change.header.stamp, stamp_ns)
        self._changes.publish(change)
