"""The referee node: ends the round of a bout and publishes the winner."""

from __future__ import annotations

from khr_analysis.referee import RefereeBlock
from khr_common.block import NodeSpec, Numbers
from khr_common.interfaces import DECISION
from khr_common.nodes.block_node import BlockNode
from khr_common.nodes.messages import status
from khr_common.statuses import KEY


class RefereeNode(BlockNode):
    """Answer each sample on ``referee``; publish ``referee/decision`` (latched) once."""

    _block: RefereeBlock

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self._decision = self.publisher(DECISION)
        self._decided = False

    def on_answer(self, stamp_ns: int, answer: tuple[Numbers, ...]) -> None:
        """Publish the decision as soon as there is one."""
        decision = self._block.decision
        if decision is not None and not self._decided:
            self._decided = True
            values = {'reason': decision.reason, 'time_s': repr(decision.time), KEY: self.run}
            self._decision.publish(status('referee', decision.winner, values))
