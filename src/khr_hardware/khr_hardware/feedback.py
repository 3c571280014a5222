"""The pitch-rate loop that the board closes by itself while a driver drives it (its *mixing*)."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from math import ceil
from statistics import mean

from khr_common.errors import KhrError
from khr_common.interfaces import BOARD_CORRECTION
from khr_hardware.client import Client
from khr_hardware.errors import BoardError
from khr_hardware.joint_map import COUNT, GyroWiring, JointMap
from khr_hardware.protocol.memory import Mixing

AT_REST = 20  # readings of the gyro that make its voltage at rest
STILL = 3  # AD steps that they may differ by
PARTS = 4  # in which a ratio is raised
PAUSE = 0.5  # s between them
SLOT = 0  # of a servo's two mixings
ANKLES, HIPS = BOARD_CORRECTION.names[:2], BOARD_CORRECTION.names[2:]


def gyro_of(joint_map: JointMap) -> GyroWiring:
    """Return the gyro of a map.

    Raises:
        KhrError: if it has none.
    """
    if joint_map.gyro is None:
        raise KhrError('mixing: the map has no gyro; accepted: a map with one')
    return joint_map.gyro


def at_rest(readings: Sequence[int]) -> int:
    """Return the AD reading of a gyro that does not turn, in steps, AD_ref left in.

    Raises:
        KhrError: if the readings are too few, or those of a robot that moves.
    """
    if len(readings) < AT_REST:
        raise KhrError(
            f'mixing: the gyro was read {len(readings)} times; accepted: {AT_REST}, so try again'
        )
    if max(readings) - min(readings) > STILL:
        raise KhrError(
            f'mixing: the gyro reads {min(readings)} to {max(readings)} steps; accepted: a robot '
            'at rest'
        )
    return round(mean(readings))


class Feedback:
    """Raise the ratios of the mixings in parts, an exchange a period; take them back at once.

    Args:
        client: of the board.
        joint_map: with a gyro.

    Raises:
        KhrError: if it has none.
    """

    def __init__(self, client: Client, joint_map: JointMap) -> None:
        self._client, self._map = client, joint_map
        self._gyro = gyro_of(joint_map)
        self._readings: deque[int] = deque(maxlen=AT_REST)
        self._reference = 0  # AD_ref as the board has it
        self._offset = 0  # of it from the voltage at rest
        self._ratios = dict.fromkeys(BOARD_CORRECTION.names, 0)
        self._round: list[tuple[str, int]] = []
        self._waited = PAUSE

    @property
    def zero(self) -> float:
        """Return the offset of the rate that the board reads relative to its reference, rad/s."""
        return self._offset * self._gyro.step

    def connect(self, references: Sequence[int]) -> None:
        """Take the AD references that the board holds."""
        self._reference = references[self._gyro.channel]

    def see(self, ad: Sequence[int]) -> None:
        """Take the AD readings of the robot at rest."""
        self._readings.append(ad[self._gyro.channel] + self._reference)

    def begin(self, offset: int) -> None:
        """Set AD_ref, so many steps off the gyro's voltage at rest.

        Raises:
            KhrError: if the robot is not at rest.
            BoardError: if the board does not take it.
        """
        reference = at_rest(self._readings) + offset
        self._readings.clear()
        self._client.set_ad_reference(self._gyro.channel, reference)
        self._reference, self._offset = reference, offset

    def raise_to(self, ankle: int, hip: int, seconds: float) -> bool:
        """Come nearer to the ratios that are wanted; return whether the board has them.

        Args:
            ankle, hip: counts per AD step, 0 to 127.
            seconds: since the last call.

        Raises:
            BoardError: if the board does not take one.
        """
        wanted = dict.fromkeys(ANKLES, ankle) | dict.fromkeys(HIPS, hip)
        self._waited += seconds
        if not self._round and self._waited >= PAUSE:
            self._waited = 0.0
            self._round = [
                (joint, min(ratio, self._ratios[joint] + ceil(ratio / PARTS)))
                for joint, ratio in wanted.items()
                if ratio != self._ratios[joint]
            ]
        if self._round:
            self._write(*self._round[0])
            self._round.pop(0)
        return wanted == self._ratios

    def end(self) -> None:
        """Take all ratios back; raises BoardError if the board does not take one."""
        self._round, self._waited = [], PAUSE
        for joint in [joint for joint, ratio in self._ratios.items() if ratio]:
            self._write(joint, 0)

    def correction(self, ad: Sequence[int]) -> tuple[float, ...]:
        """Return the board's correction of each joint in ``BOARD_CORRECTION``, rad."""
        steps = self._gyro.sign * ad[self._gyro.channel]
        return tuple(ratio * steps * COUNT for ratio in self._ratios.values())

    def _write(self, joint: str, ratio: int) -> None:
        servo = self._map.servos[joint]
        mixing = Mixing.of_ad(self._gyro.channel, servo.sign * self._gyro.sign * ratio)
        self._client.set_mixing(servo.ics, SLOT, mixing)
        found = self._client.record(servo.ics).mixings[SLOT]
        if found != mixing:
            raise BoardError(f'{joint}: its mixing reads {found} after {mixing} was written')
        self._ratios[joint] = ratio
