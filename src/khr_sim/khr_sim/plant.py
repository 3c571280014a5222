"""What the controllers face: the world behind the board's mixing, with its fingerprint.

The simulator node and a run without ROS use this same object, so both give the same trajectory.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from math import radians

from khr_common.quoting import quoted
from khr_sim.errors import SimError
from khr_sim.push import Push
from khr_sim.robot import JOINTS
from khr_sim.run_parameters import RunParameters
from khr_sim.truth import Truth
from khr_sim.world import World

_INDEX = {name: index for index, name in enumerate(JOINTS)}


def mix(reference: Sequence[float], corrections: Sequence[Mapping[str, float]]) -> list[float]:
    """Add corrections, by joint name, to a reference of all joints, in rad.

    The order of the corrections is the order of summation, which bit-equal runs must share.

    Raises:
        SimError: if a correction names a joint that the robot does not have.
    """
    target = list(reference)
    for correction in corrections:
        for joint, angle in correction.items():
            if joint not in _INDEX:
                raise SimError(
                    f'joint: {quoted(joint)} is not accepted; accepted: {" | ".join(JOINTS)}'
                )
            target[_INDEX[joint]] += angle
    return target


class Plant:
    """A world that starts from a posture, ends by itself, and hashes its trajectory."""

    def __init__(self, parameters: RunParameters) -> None:
        self.parameters = parameters
        self._timed = [Push.parse(text) for text in parameters.pushes if text]
        self.world = World(parameters)
        self._hash = hashlib.sha256()
        self._end_ns = round(parameters.duration * 1e9) or None
        self.truth: Truth

    def start(self, posture: Sequence[float]) -> Truth:
        """Put the robot on the ground in ``posture``, 17 joint angles in rad, at time zero."""
        self._hash = hashlib.sha256()
        return self._take(self.world.reset(posture), start=True)

    def advance(self, target: Sequence[float]) -> Truth:
        """Simulate one control period towards ``target``, 17 joint angles in rad."""
        return self._take(self.world.advance(target))

    def configure(self, parameters: RunParameters) -> None:
        """Take changed parameters."""
        self.parameters = parameters
        self.world.configure(parameters)

    def close(self) -> None:
        """Release the engine."""
        self.world.close()

    @property
    def end(self) -> str:
        """Say why the run is over; empty while it is not."""
        if self.truth.tilt > radians(self.parameters.stop_when_tilted_deg):
            return 'tilted'
        if self._end_ns is not None and self.truth.stamp_ns >= self._end_ns:
            return 'duration'
        return ''

    @property
    def trajectory_hash(self) -> str:
        """Return the SHA-256 over the records of all instants so far, in hex."""
        return self._hash.hexdigest()

    def _take(self, truth: Truth, start: bool = False) -> Truth:
        if start:
            for push in self._timed:
                self.world.push(push)
        self.truth = truth
        self._hash.update(truth.record())
        return truth
