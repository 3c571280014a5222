"""The foot-force node: a resistive sensor under toe and heel of each foot."""

from __future__ import annotations

from functools import partial

from geometry_msgs.msg import WrenchStamped

from khr_common import cdr
from khr_common.cdr import BLANK
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import run_node
from khr_common.stamps import StampedSet, StampJudge
from khr_sim.foot_force import FootForce, FootForceParameters
from khr_sim.truth import CONTACTS


class FootForceNode(KhrNode):
    """Turn ``ground_truth/contact/*`` into ``foot_force/*``, normal forces in the same frames."""

    def __init__(self) -> None:
        super().__init__('foot_force', FootForceParameters)
        self._sensors = FootForce(self.parameters)
        self._judge = StampJudge(self._sensors.reset)
        self._contacts = StampedSet(tuple(CONTACTS))
        self._outputs = []
        for name, frame in CONTACTS.items():
            answer = WrenchStamped()
            answer.header.frame_id, answer.wrench.force.z = frame, BLANK
            self._outputs.append(self.publish_form(answer, f'foot_force/{name}'))
        for name in CONTACTS:
            self.listen_to_bytes(
                WrenchStamped, f'ground_truth/contact/{name}', partial(self._on_contact, name)
            )

    def configure(self, parameters: FootForceParameters) -> None:
        """Pass changed parameters to the sensors."""
        self._sensors.configure(parameters)

    def _on_contact(self, name: str, contact: bytes) -> None:
        stamp_ns = cdr.clock(contact)
        forces = self._contacts.put(name, stamp_ns, cdr.force(contact))
        if forces is None:
            return
        if self._judge.is_new(stamp_ns):
            for output, normal in zip(self._outputs, self._sensors.update(forces), strict=True):
                output.fill(stamp_ns, (normal,))
        for output in self._outputs:
            output.send()


def main() -> int:
    """Run the foot-force node."""
    return run_node(FootForceNode)


if __name__ == '__main__':
    raise SystemExit(main())
