"""The base class of nodes that receive a whole run and answer nothing."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String

from khr_common.block import NodeSpec
from khr_common.interfaces import FINISHED, READY, STATE
from khr_common.nodes.node import KhrNode
from khr_common.statuses import check_status, ready_text

REPORT_PERIOD = 1_500_000_000  # ns of simulated time between reports of how far a listener is


class Listener(KhrNode):
    """A node that receives every sample of a run, and reports its progress.

    The run starts when every listener has reported on ``ready`` (latched). In lockstep it waits
    for a listener that falls far behind, since the middleware drops samples that are not fetched.
    It is over when every listener has received the last sample.

    Attributes:
        end: stamp of the last sample of a finished run, ns; negative before the end.
    """

    patience = 2.0

    def __init__(self, spec: NodeSpec) -> None:
        super().__init__(spec)
        self.end = -1
        self._received, self._reported = -1, -REPORT_PERIOD
        self._ready = self.publisher(READY)
        self.subscribe(STATE, self.on_state)

    def received(self, stamp_ns: int) -> None:
        """Note that all samples up to a stamp have arrived; report it at intervals."""
        self._received = stamp_ns
        near = stamp_ns - self._reported < REPORT_PERIOD
        if not near or (self.received_all and self._reported < self.end):
            self._report_progress()

    @property
    def received_all(self) -> bool:
        """Return whether the run has finished and its last sample has arrived."""
        return self._received >= self.end >= 0

    def settled(self) -> bool:
        """Return whether the end of the run has arrived, which the simulator waits for.

        All nodes of a launch are interrupted at once, so the end may be yet to come.
        """
        return self.received_all

    def on_state(self, state: DiagnosticStatus) -> None:
        """Take a change of the simulator's state.

        Raises:
            MalformedError: if it is of another run, or not readable.
        """
        values = {pair.key: pair.value for pair in state.values}
        check_status(values, self.run)
        self.end = int(values['time_ns']) if state.message == FINISHED else -1
        if self.received_all:
            self._report_progress()

    def _report_progress(self) -> None:
        self._reported = self._received
        self._ready.publish(String(data=ready_text(self.get_name(), self._received, self.run)))
