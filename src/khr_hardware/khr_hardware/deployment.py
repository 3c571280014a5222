"""The pitch-rate loop on the board itself: its own mixing, written and taken back.

Only RAM is written, so all of it is gone when the battery is switched off.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from khr_common.errors import KhrError
from khr_hardware.client import Client
from khr_hardware.feedback import AT_REST, PARTS, PAUSE, SLOT, at_rest, gyro_of
from khr_hardware.joint_map import JointMap
from khr_hardware.protocol import memory
from khr_hardware.protocol.memory import Mixing, ServoRecord

CYCLE = 0.015  # s, an output cycle


@dataclass(frozen=True)
class BoardLoop:
    """A pitch-rate loop as the board can have it.

    Attributes:
        factors: counts per AD step of the gyro, by joint; the signs of the servos are left out.
        offset: AD steps that the gyro's reference lies off its voltage at rest.
        asked: the factors before they were rounded.
    """

    factors: Mapping[str, int]
    offset: int
    asked: Mapping[str, float] = field(default_factory=dict, compare=False)


def deploy(
    client: Client,
    joint_map: JointMap,
    loop: BoardLoop,
    keep: Callable[[dict[str, Any]], None],
    wait: Callable[[float], None] = time.sleep,
) -> None:
    """Write a loop to the board, its factors raised in parts, and read it back.

    Args:
        client: of the board.
        joint_map: with a gyro.
        loop: to write.
        keep: receives the argument of :func:`undo`, before anything is written.
        wait: for so many seconds.

    Raises:
        KhrError: if another mixing reads the gyro as well, the robot is not at rest, or the
            board reads otherwise afterwards.
        BoardError: if the board does not answer.
    """
    channel = gyro_of(joint_map).channel
    servos = {joint_map.servos[joint]: factor for joint, factor in loop.factors.items()}
    records = {ics: client.record(ics) for ics in client.assigned()}
    _check_alone(records, [servo.ics for servo in servos], channel, joint_map)
    reference = client.ad_references()[channel]
    seen = []
    for _ in range(AT_REST):
        wait(CYCLE)  # it converts once in each
        seen.append(client.ad()[channel] + reference)
    zero = at_rest(seen) + loop.offset
    mixings = {servo.ics: records[servo.ics].mixings[SLOT] for servo in servos}
    held = {str(ics): [mixing.source, mixing.ratio] for ics, mixing in mixings.items()}
    keep({'channel': channel, 'reference': reference, 'mixings': held})
    for servo in servos:
        client.set_mixing(servo.ics, SLOT, Mixing(memory.NO_SOURCE, 0))
    client.set_ad_reference(channel, zero)
    for part in range(1, PARTS + 1):
        for servo, factor in servos.items():
            share = servo.sign * (factor * part // PARTS)
            client.set_mixing(servo.ics, SLOT, Mixing.of_ad(channel, share))
        wait(PAUSE)
    for servo, factor in servos.items():
        found = client.record(servo.ics).mixings[SLOT]
        if found != Mixing.of_ad(channel, servo.sign * factor):
            raise KhrError(f'ICS {servo.ics}: reads {found} after it was written')
    if (read := client.ad_references()[channel]) != zero:
        raise KhrError(f'AD_ref of AD{channel}: reads {read} after {zero} was written')


def _check_alone(
    records: Mapping[int, ServoRecord], own: Sequence[int], channel: int, joint_map: JointMap
) -> None:
    """Refuse a loop beside mixings that would close it twice, or that its AD_ref would shift."""
    for ics, record in records.items():
        for slot, mixing in enumerate(record.mixings):
            written = ics in own and slot == SLOT
            if mixing.active and mixing.ad_channel == channel and not written:
                raise KhrError(
                    f'mixing {slot + 1} of {joint_map.joint_of(ics) or "a servo"} (ICS {ics}) '
                    f'reads AD{channel} too; accepted: none, so undo the last deploy, or switch '
                    'the battery off and on'
                )


def undo(client: Client, data: Any) -> None:
    """Write back the memory that :func:`deploy` passed to ``keep``.

    Raises:
        KhrError: if it is something else.
        BoardError: if the board does not answer.
    """
    try:
        channel, reference = int(data['channel']), int(data['reference'])
        mixings = {int(ics): Mixing(int(a), int(b)) for ics, (a, b) in data['mixings'].items()}
        frames = [(ics, mixing, mixing.encode()) for ics, mixing in mixings.items()]
    except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
        raise KhrError(
            f'undo: {json.dumps(data)[:80]} is not accepted; accepted: what khr board deploy wrote'
        ) from error
    for ics, mixing, _ in frames:
        client.set_mixing(ics, SLOT, Mixing(mixing.source, 0))
    client.set_ad_reference(channel, reference)
    for ics, mixing, _ in frames:
        client.set_mixing(ics, SLOT, mixing)
