"""Deploy the pitch-rate loop to the board's own mixing, and undo it.

Only RAM is written, so switching the battery off also removes the loop.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from khr_common.errors import KhrError
from khr_hardware.client import Client
from khr_hardware.feedback import (
    MIXING_SLOT,
    RAMP_STEPS,
    REST_SAMPLES,
    STEP_PAUSE,
    gyro_of,
    rest_level,
)
from khr_hardware.joint_map import JointMap
from khr_hardware.protocol import memory
from khr_hardware.protocol.memory import Mixing, ServoRecord

CYCLE = 0.015  # s, an output cycle


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
    wait: Callable[[float], None] = time.sleep,
) -> None:
    """Write a loop to the board, raise its factors in steps, and read it back.

    Args:
        client: of the board.
        joint_map: with a gyro.
        loop: to write.
        keep: called with the former values, for :func:`undo`, before the first write.
        wait: sleep function, s.

    Raises:
        KhrError: if another mixing also reads the gyro, the robot is not at rest, or the
            values read back differ.
        BoardError: if the board does not answer.
    """
    channel = gyro_of(joint_map).channel
    servos = {joint_map.servos[joint]: factor for joint, factor in loop.factors.items()}
    records = {ics: client.record(ics) for ics in client.assigned()}
    _check_alone(records, [servo.ics for servo in servos], channel, joint_map)
    reference = client.ad_references()[channel]
    seen = []
    for _ in range(REST_SAMPLES):
        wait(CYCLE)  # the board converts once per cycle
        seen.append(client.ad()[channel] + reference)
    zero = rest_level(seen) + loop.offset
    mixings = {servo.ics: records[servo.ics].mixings[MIXING_SLOT] for servo in servos}
    held = {str(ics): [mixing.source, mixing.ratio] for ics, mixing in mixings.items()}
    keep({'channel': channel, 'reference': reference, 'mixings': held})
    for servo in servos:
        client.set_mixing(servo.ics, MIXING_SLOT, Mixing(memory.NO_SOURCE, 0))
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

    Raises:
        KhrError: if the data has another form.
        BoardError: if the board does not answer.
    """
    try:
        channel, reference = int(data['channel']), int(data['reference'])
        mixings = {int(ics): Mixing(int(a), int(b)) for ics, (a, b) in data['mixings'].items()}
        frames = [(ics, mixing, mixing.encode()) for ics, mixing in mixings.items()]
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        raise KhrError(
            f'undo: {json.dumps(data)[:80]} is not accepted; accepted: the file of khr board deploy'
        ) from error
    for ics, mixing, _ in frames:
        client.set_mixing(ics, MIXING_SLOT, Mixing(mixing.source, 0))
    client.set_ad_reference(channel, reference)
    for ics, mixing, _ in frames:
        client.set_mixing(ics, MIXING_SLOT, mixing)
