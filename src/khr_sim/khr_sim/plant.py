"""What the controllers face: the world behind the board's delay, with its trajectory hash.

The simulator node, a run without ROS and the Gymnasium environment use this same object, so all
give the same trajectory.
"""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import radians

from khr_common.arithmetic import warn_unless_portable
from khr_common.errors import KhrError
from khr_common.text.quoting import quoted
from khr_sim.physics.push import Push
from khr_sim.physics.truth import Truth
from khr_sim.physics.world import World
from khr_sim.robot import JOINTS
from khr_sim.run_parameters import RunParameters

_INDEX = {name: index for index, name in enumerate(JOINTS)}


def mix(reference: Sequence[float], corrections: Sequence[Mapping[str, float]]) -> list[float]:
    """Add corrections, by joint name, to a reference of all joints, in rad.

    The order of the corrections is the order of summation, which bit-equal runs must share.

    Raises:
        KhrError: if a correction names a joint that the robot does not have.
    """
    target = list(reference)
    for correction in corrections:
        for joint, angle in correction.items():
            if joint not in _INDEX:
                raise KhrError(
                    f'joint: {quoted(joint)} is not accepted; accepted: {" | ".join(JOINTS)}'
                )
            target[_INDEX[joint]] += angle
    return target


class Plant:
    """A world that starts from a posture, ends by itself, and hashes its trajectory.

    The answers to its instants are handed over in their order; each acts ``control_delay`` periods
    after its instant. Until the first one acts the board holds the posture.
    """

    def __init__(self, parameters: RunParameters) -> None:
        self.parameters = parameters
        self._timed = [Push.parse(text) for text in parameters.pushes if text]
        self.world = World(parameters)
        warn_unless_portable()
        self._hash = hashlib.sha256()
        self._end_ns = round(parameters.duration * 1e9) or None
        self._due: deque[Sequence[float]] = deque()  # targets of the coming periods, rad
        self.truth: Truth

    def start(self, posture: Sequence[float]) -> Truth:
        """Put the robot on the ground in ``posture``, 17 joint angles in rad, at time zero."""
        self._hash = hashlib.sha256()
        self._due = deque([posture] * self.parameters.control_delay)
        truth = self._take(self.world.reset(posture))
        for push in self._timed:
            self.world.push(push)
        return truth

    def answer(self, target: Sequence[float]) -> None:
        """Take the answer to the next instant: 17 joint angles in rad."""
        self._due.append(target)

    @property
    def ready(self) -> bool:
        """Return whether the answer that acts in the coming period is there."""
        return bool(self._due)

    def advance(self) -> Truth:
        """Simulate one control period towards the answer that is due.

        Raises:
            KhrError: if it has not been given, or is not 17 finite numbers.
        """
        if not self._due:
            raise KhrError('answer: missing; accepted: one to every instant, before it acts')
        return self._take(self.world.advance(self._due.popleft()))

    def configure(self, parameters: RunParameters) -> None:
        """Take changed parameters."""
        self.parameters = parameters
        self.world.configure(parameters)

    def reseed(self, parameters: RunParameters) -> bool:
        """Take parameters for the next start, if the seed alone is new; return whether it is."""
        if replace(parameters, seed=self.parameters.seed) != self.parameters:
            return False
        self.parameters = self.world.parameters = parameters
        return True

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

    def _take(self, truth: Truth) -> Truth:
        self.truth = truth
        self._hash.update(truth.record())
        return truth
