"""The ankle controller node: gyro rate or toe-heel difference, fed back to both ankles."""

from __future__ import annotations

from functools import partial

from geometry_msgs.msg import WrenchStamped
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu

from khr_balance.ankle import AnkleController, AnkleControllerParameters
from khr_balance.nodes.correction import CorrectionNode
from khr_common import wire
from khr_common.node import StampedSet, run_node

REGIONS = ('left_toe', 'left_heel', 'right_toe', 'right_heel')


class AnkleControllerNode(CorrectionNode):
    """Answer each sample of the chosen source with law (3.13) or (5.3).

    Only the chosen source is subscribed to; the simulator asks again for what is missing, so a
    change of source during a run loses nothing.
    """

    def __init__(self) -> None:
        super().__init__('ankle_controller', AnkleControllerParameters,
                         ('l_ankle_pitch', 'r_ankle_pitch'))
        self._controller = AnkleController(self.parameters)
        self._forces = StampedSet(REGIONS)
        self._subscriptions_in_use: list[Subscription] = []
        self._source = ''
        self._listen()

    def configure(self, parameters: AnkleControllerParameters) -> None:
        """Pass changed parameters to the law, and listen to its source."""
        self._controller.configure(parameters)
        self._listen()

    def _listen(self) -> None:
        if self.parameters.source == self._source:
            return
        self._source = self.parameters.source
        for subscription in self._subscriptions_in_use:
            self.destroy_subscription(subscription)
        if self._source == 'gyro':
            self._subscriptions_in_use = [
                self.listen_to_bytes(Imu, 'imu/data_raw', self._on_imu)]
        else:
            self._subscriptions_in_use = [
                self.listen_to_bytes(WrenchStamped, f'foot_force/{name}',
                                     partial(self._on_force, name))
                for name in REGIONS]

    def _on_imu(self, imu: bytes) -> None:
        self.answer(wire.clock(imu), lambda time: self._controller.update(
            time, pitch_rate=wire.angular_velocity(imu)[1]))

    def _on_force(self, name: str, force: bytes) -> None:
        stamp_ns = wire.clock(force)
        forces = self._forces.put(name, stamp_ns, wire.force(force)[2])
        if forces is not None:
            self.answer(stamp_ns, lambda time: self._controller.update(
                time, foot_forces=forces))


def main() -> int:
    """Run the ankle controller node."""
    return run_node(AnkleControllerNode)


if __name__ == '__main__':
    raise SystemExit(main())
