"""The pitch-rate loop that the board closes by its *mixing*.

The driver raises it during its run; ``khr board deploy`` leaves it on the board. Only RAM is
written, so switching the battery off also removes the loop.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from math import ceil
from typing import Any

from khr_common.errors import KhrError
from khr_common.interfaces import BOARD_CORRECTION
from khr_hardware.client import Client
from khr_hardware.errors import BoardError
from khr_hardware.gyro import REST_SAMPLES, RestingGyro, rest_level
from khr_hardware.joint_map import COUNT, GyroWiring, JointMap, ServoWiring
from khr_hardware.protocol.memory import Mixing, ServoRecord

RAMP_STEPS = 4  # equal steps in which a ratio is raised
STEP_PAUSE = 0.5  # s between two of these steps
MIXING_SLOT = 0  # the used one of a servo's two mixings
ANKLES, HIPS = BOARD_CORRECTION.names[:2], BOARD_CORRECTION.names[2:]
CYCLE = 0.015  # s, an output cycle


def gyro_of(joint_map: JointMap) -> GyroWiring:
    """Return the gyro of a map.

    Raises:
        KhrError: if the map has no gyro.
    """
    if joint_map.gyro is None:
        raise KhrError('mixing: the map has no gyro; accepted: a map with one')
    return joint_map.gyro


class Feedback:
    """Raise the ratios of the mixings in steps, one write per period; reset them at once.

    Attributes:
        gyro: the gyro; the board subtracts its level at rest.

    Raises:
        KhrError: if the map has no gyro.
    """

    def __init__(self, client: Client, joint_map: JointMap) -> None:
        self._client, self._map = client, joint_map
        self.gyro = RestingGyro(gyro_of(joint_map))
        self._former: int | None = None  # AD_ref before it was set, to restore
        self._ratios = dict.fromkeys(BOARD_CORRECTION.names, 0)
        self._mixed: set[str] = set()  # joints that may have a mixing, read back or not
        self._round: list[tuple[str, int]] = []
        self._waited = STEP_PAUSE

    @property
    def mixed(self) -> list[str]:
        """Return the joints that may have a mixing."""
        return sorted(self._mixed)

    def set_reference(self, offset: int) -> None:
        """Set AD_ref to the gyro's voltage at rest plus an offset in AD steps.

        Raises:
            BoardError: if the board does not accept it.
        """
        if self._former is None:  # the board may set it and its reply be lost
            self._former = self.gyro.reference
        self._write_reference(self.gyro.level + offset)

    def raise_to(self, ankle: int, hip: int, seconds: float) -> bool:
        """Raise the ratios towards their targets; return whether the board has reached them.

        Args:
            ankle, hip: counts per AD step, 0 to 127.
            seconds: since the last call.

        Raises:
            BoardError: if the board does not accept a ratio.
        """
        wanted = dict.fromkeys(ANKLES, ankle) | dict.fromkeys(HIPS, hip)
        self._waited += seconds
        if not self._round and self._waited >= STEP_PAUSE:
            self._waited = 0.0
            self._round = [
                (joint, min(ratio, self._ratios[joint] + ceil(ratio / RAMP_STEPS)))
                for joint, ratio in wanted.items()
                if ratio != self._ratios[joint]
            ]
        if self._round:
            self._write(*self._round[0])
            self._round.pop(0)
        return wanted == self._ratios

    def end(self) -> None:
        """Set all ratios to 0, each one even if another fails, and then restore AD_ref.

        While a mixing stays, its AD_ref stays too: another one would move its servo.

        Raises:
            BoardError: if the board does not accept a write.
        """
        self._round, self._waited = [], STEP_PAUSE
        _write_all([partial(self._write, joint, 0) for joint in self.mixed])
        if self._former is not None:
            self._write_reference(self._former)
            self._former = None

    def correction(self, ad: Sequence[int]) -> tuple[float, ...]:
        """Return the board's correction of each joint in ``BOARD_CORRECTION``, rad."""
        wiring = self.gyro.wiring
        steps = wiring.sign * ad[wiring.channel]
        return tuple(ratio * steps * COUNT for ratio in self._ratios.values())

    def _write_reference(self, value: int) -> None:
        self._client.set_ad_reference(self.gyro.wiring.channel, value)
        self.gyro.reference = value

    def _write(self, joint: str, ratio: int) -> None:
        servo, wiring = self._map.servos[joint], self.gyro.wiring
        mixing = Mixing.of_ad(wiring.channel, servo.sign * wiring.sign * ratio)
        self._mixed.add(joint)  # the board may write it and its reply be lost
        self._client.set_mixing(servo.ics, MIXING_SLOT, mixing)
        found = self._client.record(servo.ics).mixings[MIXING_SLOT]
        if found != mixing:
            raise BoardError(f'{joint}: mixing {found} was read back; expected: {mixing}')
        self._ratios[joint] = ratio
        if not ratio:
            self._mixed.discard(joint)


@dataclass(frozen=True)
class BoardLoop:
    """A pitch-rate loop in the units of the board."""

    # counts per AD step of the gyro, by joint, without the signs of the servos
    factors: Mapping[str, int]
    offset: int  # of the gyro's reference from its voltage at rest, AD steps
    # the factors before rounding
    asked: Mapping[str, float] = field(default_factory=dict, compare=False)


def deploy(
    client: Client,
    joint_map: JointMap,
    loop: BoardLoop,
    keep: Callable[[dict[str, Any]], None],
    forget: Callable[[], None] = lambda: None,
    wait: Callable[[float], None] = time.sleep,
) -> None:
    """Write a loop to the board, raise its factors in steps, and read it back.

    If that fails or is interrupted, the board gets its former values back.

    Args:
        client: of the board.
        joint_map: with a gyro.
        loop: to write.
        keep: called with the former values, for :func:`undo`, before the first change.
        forget: called once a failed loop is taken back.
        wait: sleep function, s.

    Raises:
        KhrError: if a servo of the loop does not answer, another mixing also reads the gyro, the
            robot is not at rest, or the values read back differ.
        BoardError: if the board does not answer.
    """
    channel = gyro_of(joint_map).channel
    servos = {joint_map.servos[joint]: factor for joint, factor in loop.factors.items()}
    records = {ics: client.record(ics) for ics in client.assigned()}
    _check_present(records, loop.factors, joint_map)
    _check_alone(records, [servo.ics for servo in servos], channel, joint_map)
    reference = client.ad_references()[channel]
    seen = []
    for _ in range(REST_SAMPLES):
        wait(CYCLE)  # the board converts once per cycle
        seen.append(client.ad()[channel] + reference)
    zero = rest_level(seen) + loop.offset
    mixings = {servo.ics: records[servo.ics].mixings[MIXING_SLOT] for servo in servos}
    held = {str(ics): [mixing.source, mixing.ratio] for ics, mixing in mixings.items()}
    former = {'channel': channel, 'reference': reference, 'mixings': held}
    keep(former)
    try:
        _write_loop(client, channel, zero, servos, wait)
    except BaseException as error:  # also Ctrl-C: a part of the loop would tilt the robot
        _take_back(client, former, str(error) or type(error).__name__)
        forget()
        raise


def _write_loop(
    client: Client,
    channel: int,
    zero: int,
    servos: Mapping[ServoWiring, int],
    wait: Callable[[float], None],
) -> None:
    """Write AD_ref and the mixings of servos, raise their factors, and read all back."""
    for servo in servos:
        client.set_mixing(servo.ics, MIXING_SLOT, Mixing())
    client.set_ad_reference(channel, zero)
    for part in range(1, RAMP_STEPS + 1):
        for servo, factor in servos.items():
            share = servo.sign * (factor * part // RAMP_STEPS)
            client.set_mixing(servo.ics, MIXING_SLOT, Mixing.of_ad(channel, share))
        wait(STEP_PAUSE)
    for servo, factor in servos.items():
        found = client.record(servo.ics).mixings[MIXING_SLOT]
        expected = Mixing.of_ad(channel, servo.sign * factor)
        if found != expected:
            raise KhrError(f'ICS {servo.ics}: mixing {found} was read back; expected: {expected}')
    if (read := client.ad_references()[channel]) != zero:
        raise KhrError(f'AD_ref of AD{channel}: {read} was read back; expected: {zero}')


def _take_back(client: Client, former: dict[str, Any], cause: str) -> None:
    """Restore the board after a failure.

    Raises:
        BoardError: if it does not accept its former values.
    """
    try:
        undo(client, former)
    except BoardError as error:
        raise BoardError(
            f'{cause}; the board could not be restored ({error}): repeat the command with --undo, '
            'or switch the battery off'
        ) from error


def _check_present(
    records: Mapping[int, ServoRecord], joints: Iterable[str], joint_map: JointMap
) -> None:
    """Refuse a board on which a servo of the loop does not answer."""
    numbers = {joint: joint_map.servos[joint].ics for joint in joints}
    missing = [
        joint for joint, ics in numbers.items() if ics not in records or not records[ics].measured
    ]
    if missing:
        raise BoardError(f'no answer from the servos of {", ".join(missing)}')


def _check_alone(
    records: Mapping[int, ServoRecord], own: Sequence[int], channel: int, joint_map: JointMap
) -> None:
    """Refuse a board with another mixing of the gyro: it would close the loop twice."""
    for ics, record in records.items():
        for slot, mixing in enumerate(record.mixings):
            written = ics in own and slot == MIXING_SLOT
            if mixing.active and mixing.ad_channel == channel and not written:
                raise KhrError(
                    f'mixing {slot + 1} of {joint_map.joint_of(ics) or "a servo"} (ICS {ics}) '
                    f'also reads AD{channel}; accepted: no other mixing of it: undo the last '
                    'deploy, or switch the battery off and on'
                )


def undo(client: Client, data: Any) -> None:
    """Restore the values that :func:`deploy` passed to ``keep``.

    The factors go to 0 first, each even if another fails. While one stays, AD_ref does too:
    another one would move its servo.

    Raises:
        KhrError: if the data has another form.
        BoardError: if the board does not accept a write.
    """
    try:
        channel, reference = int(data['channel']), int(data['reference'])
        mixings = {int(ics): Mixing(int(a), int(b)) for ics, (a, b) in data['mixings'].items()}
        for mixing in mixings.values():
            mixing.encode()  # refuses what has no form on the board, before the first write
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        raise KhrError(
            f'undo: {json.dumps(data)[:80]} is not accepted; accepted: the file of khr board deploy'
        ) from error
    off = [(ics, Mixing(mixing.source, 0)) for ics, mixing in mixings.items()]
    _write_all([partial(client.set_mixing, ics, MIXING_SLOT, mixing) for ics, mixing in off])
    client.set_ad_reference(channel, reference)
    _write_all([partial(client.set_mixing, ics, MIXING_SLOT, m) for ics, m in mixings.items()])


def _write_all(writes: Sequence[Callable[[], None]]) -> None:
    """Do every write, also if another fails, and then raise the last error."""
    failed: BoardError | None = None
    for write in writes:
        try:
            write()
        except BoardError as error:
            failed = error
    if failed:
        raise failed
