"""The stage node selects the active controllers by the inclination measured at the feet."""

from __future__ import annotations

from math import degrees

from diagnostic_msgs.msg import DiagnosticArray

from khr_common.block import NodeSpec, Numbers
from khr_common.interfaces import STAGE_CHANGES
from khr_common.nodes.block_node import BlockNode
from khr_common.nodes.messages import restamp, status

MEANING = {1: 'no control', 2: 'ankle', 3: 'ankle and hip'}


class StageNode(BlockNode):
    """Publish ``stage`` for each sample, and each change of the stage on ``stage/changes``.

    ``stage/changes`` is latched with its history: the stage at the start of the run, then each new
    stage. A recorder that is late receives them all.
    """

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._number = 0
        self._changes = self.publisher(STAGE_CHANGES, history=True)

    def on_answer(self, stamp_ns: int, answer: tuple[Numbers, ...]) -> None:
        """Publish the stage if it has changed."""
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
