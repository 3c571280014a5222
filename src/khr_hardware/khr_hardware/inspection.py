"""Read the state of a board and its robot, and bring it to rest."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees

from khr_common.errors import KhrError
from khr_hardware.client import Client
from khr_hardware.errors import BoardError
from khr_hardware.joint_map import JointMap
from khr_hardware.protocol import memory
from khr_hardware.protocol.memory import BATTERY_VOLTS, FREE, HOLD, Config, Mixing, ServoRecord

STILL = 30  # counts, 1 deg: a servo that moves less between two readings is at rest
STILL_READS = 20  # readings until it is held even so; a begun move goes on for its cycles


@dataclass(frozen=True)
class Inspection:
    """The values read from a board."""

    version: str  # of the firmware, as text
    config: Config  # configuration word
    assigned: Sequence[int]  # ICS numbers of the servos assigned in the board
    ad: Sequence[int]  # readings of the AD channels minus their references, in steps
    references: Sequence[int]  # of the AD channels, in steps
    records: Mapping[int, ServoRecord]  # of the servos in the map that are assigned, by ICS number

    @property
    def battery(self) -> float:
        """Return the voltage of the battery, V."""
        return (self.ad[0] + self.references[0]) * BATTERY_VOLTS

    def missing(self, joint_map: JointMap) -> list[str]:
        """List the joints of a map for which the servo does not answer."""
        return [
            joint
            for joint, servo in joint_map.servos.items()
            if servo.ics not in self.records or not self.records[servo.ics].measured
        ]

    def differing_trims(self, joint_map: JointMap) -> dict[str, tuple[int, int]]:
        """Return the differing trims as (on the board, in the map), by joint."""
        return {
            joint: (self.records[servo.ics].trim, servo.trim)
            for joint, servo in joint_map.servos.items()
            if servo.ics in self.records and self.records[servo.ics].trim != servo.trim
        }

    def check_trims(self, joint_map: JointMap) -> None:
        """Compare the trims with those of a map.

        Raises:
            KhrError: if one differs.
        """
        found = ', '.join(
            f'{joint} {own} (map: {expected})'
            for joint, (own, expected) in self.differing_trims(joint_map).items()
        )
        if found:
            raise KhrError(
                f'trims on the board: {found} not accepted; accepted: those of the map: correct '
                'the map, or the project on the board'
            )

    def mixings(self) -> dict[int, list[memory.Mixing]]:
        """Return the active mixings by ICS number."""
        found = {
            ics: [mixing for mixing in record.mixings if mixing.active]
            for ics, record in self.records.items()
        }
        return {ics: active for ics, active in found.items() if active}

    def pose(self, joint_map: JointMap) -> list[float]:
        """Return the 17 joint angles in rad.

        Raises:
            BoardError: if a servo does not answer.
        """
        missing = self.missing(joint_map)
        if missing:
            raise BoardError(f'no answer from the servos of {", ".join(missing)}')
        return joint_map.angles({ics: record.measured for ics, record in self.records.items()})


def inspect(client: Client, joint_map: JointMap) -> Inspection:
    """Read a board.

    Raises:
        BoardError: as :meth:`Client.exchange`.
    """
    version = client.version()
    config, assigned = client.config(), client.assigned()
    records = {ics: client.record(ics) for ics in joint_map.numbers if ics in assigned}
    text = ' '.join(version[:-1].decode('ascii', 'replace').split())
    return Inspection(text, config, assigned, client.ad(), client.ad_references(), records)


def silence(client: Client, seen: Inspection, config: Config) -> None:
    """Write a configuration, and set the ratios of all active mixings to 0.

    Args:
        client: of the board.
        seen: its state before.
        config: to write, if it differs; with the ROM program off.

    Raises:
        BoardError: if the board does not accept it.
    """
    if config != seen.config:
        client.set_config(config)
    for ics, record in seen.records.items():
        for slot, mixing in enumerate(record.mixings):
            if mixing.active:
                client.set_mixing(ics, slot, Mixing(mixing.source, 0))


def torque_of(record: ServoRecord) -> str:
    """Return the state of a servo as text: free, hold, or its target position."""
    return {FREE: 'free', HOLD: 'hold'}.get(record.reference, str(record.reference))


def hold_pose(
    client: Client, joint_map: JointMap, wait: Callable[[float], None] = time.sleep
) -> None:
    """Switch the torque on with every servo at its present position.

    The measured positions are written as targets, because manuals and clients disagree about the
    meaning of 0x7FFF. The ROM program and the mixings are stopped first: either moves servos.

    Args:
        client: of the board.
        joint_map: of the robot.
        wait: sleep function, s.

    Raises:
        BoardError: if a servo does not answer; before the program is stopped, nothing is written.
        KhrError: if a position is outside the servo's range.
    """
    seen = inspect(client, joint_map)
    positions = _targets(seen, joint_map)
    silence(client, seen, seen.config.quiet())
    for _ in range(STILL_READS):
        wait(2 * seen.config.cycle)  # the cycle under way still moves them
        before = positions
        records = {ics: client.record(ics) for ics in positions}
        positions = _targets(replace(seen, records=records), joint_map)
        if all(abs(positions[ics] - before[ics]) <= STILL for ics in positions):
            break
    client.move(positions)


def _targets(seen: Inspection, joint_map: JointMap) -> dict[int, int]:
    """Return the measured positions by ICS number, as targets that the servos accept."""
    seen.pose(joint_map)  # raises if a servo does not answer
    positions = {ics: record.measured for ics, record in seen.records.items()}
    for ics, position in positions.items():
        raw = position + seen.records[ics].trim
        if not memory.LOWEST <= raw <= memory.HIGHEST:
            raise KhrError(
                f'{joint_map.joint_of(ics)}: position {raw} is not accepted; accepted: '
                f'{memory.LOWEST} to {memory.HIGHEST}'
            )
    return positions


def describe(seen: Inspection, joint_map: JointMap) -> list[tuple[str, str]]:
    """Return the values as labelled lines."""
    config = seen.config
    lines = [
        ('firmware', seen.version + ('' if seen.version == _KNOWN else ' (not the known one)')),
        (
            'configuration',
            f'{config.word:#06x}: servo bus {_on(config.ics)}, ROM program {_on(config.program)}, '
            f'vector jumps {_on(config.jumps)}, output cycle {config.cycle * 1e3:g} ms, '
            f'{config.baud} baud',
        ),
        ('battery', f'{seen.battery:.2f} V'),
        ('servos', f'{len(seen.records)} of {len(joint_map.servos)} of the map are assigned'),
        ('missing', ', '.join(seen.missing(joint_map)) or 'none'),
    ]
    lines += [
        ('trim', f'{joint}: {found} on the board, {expected} in the map')
        for joint, (found, expected) in seen.differing_trims(joint_map).items()
    ]
    lines += [
        (
            'mixing',
            f'{joint_map.joint_of(ics)}: '
            + ', '.join(f'{each.source:#06x} x {each.factor}' for each in active),
        )
        for ics, active in seen.mixings().items()
    ]
    lines.append(('AD_ref', ', '.join(map(str, seen.references))))
    return lines + readings(seen.ad, joint_map)


def readings(ad: Sequence[int], joint_map: JointMap) -> list[tuple[str, str]]:
    """Return the readings of AD channels, gyro and force sensors as labelled lines."""
    lines = [('AD', ', '.join(f'{channel}: {value}' for channel, value in enumerate(ad)))]
    if joint_map.gyro:
        lines.append(('pitch rate', f'{degrees(joint_map.pitch_rate(ad)):.1f} deg/s'))
    lines += [
        (f'force {region}', f'{force:.2f} N')
        for region, force in joint_map.normal_forces(ad).items()
    ]
    return lines


def _on(value: bool) -> str:
    return 'on' if value else 'off'


_KNOWN = ' '.join(memory.VERSION[:-1].decode().split())
