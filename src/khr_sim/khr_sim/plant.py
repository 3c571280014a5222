"""The controlled plant: the world behind the delay of the board, with its trajectory hash.

The simulator node, a run without ROS and the Gymnasium environment share this class, so that all
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
from khr_description.robot import JOINTS
from khr_sim.physics.push import Push
from khr_sim.physics.truth import GroundTruth
from khr_sim.physics.world import World
from khr_sim.run_parameters import RunParameters

_INDEX = {name: index for index, name in enumerate(JOINTS)}


def mix(reference: Sequence[float], corrections: Sequence[Mapping[str, float]]) -> list[float]:
    """Add corrections, by joint name, to a reference of all joints, in rad.

    The corrections are summed in their order, which must be the same in bit-equal runs.

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
    """A world with control delay, end conditions and a hash of its trajectory.

    Answers are passed in the order of the samples; each acts ``control_delay`` periods after its
    sample. Until the first one acts the board holds the initial posture.
    """

    def __init__(self, parameters: RunParameters) -> None:
        self.parameters = parameters
        self._timed = [Push.parse(text) for text in parameters.pushes if text]
        self.world = World(parameters)
        warn_unless_portable()
        self._hash = hashlib.sha256()
        self._end_ns = round(parameters.duration * 1e9) or None
        self._due: deque[Sequence[float]] = deque()  # targets of the coming periods, rad
        self.truth: GroundTruth

    def start(self, posture: Sequence[float]) -> GroundTruth:
        """Put the robot on the ground in ``posture``, 17 joint angles in rad, at time zero."""
        self._hash = hashlib.sha256()
        self._due = deque([posture] * self.parameters.control_delay)
        truth = self._take(self.world.reset(posture))
        for push in self._timed:
            self.world.push(push)
        return truth

    def answer(self, target: Sequence[float]) -> None:
        """Queue the answer to the next sample: 17 joint angles in rad."""
        self._due.append(target)

    @property
    def ready(self) -> bool:
        """Return whether the answer for the next period is queued."""
        return bool(self._due)

    def advance(self) -> GroundTruth:
        """Simulate one control period towards the next queued answer.

        Raises:
            KhrError: if the answer is missing, or is not 17 finite numbers.
        """
        if not self._due:
            raise KhrError('answer: missing; accepted: one to each sample, before it acts')
        return self._take(self.world.advance(self._due.popleft()))

    def configure(self, parameters: RunParameters) -> None:
        """Apply changed parameters."""
        self.parameters = parameters
        self.world.configure(parameters)

    def reseed(self, parameters: RunParameters) -> bool:
        """Apply parameters for the next start and return True if only the seed differs."""
        if replace(parameters, seed=self.parameters.seed) != self.parameters:
            return False
        self.parameters = self.world.parameters = parameters
        return True

    def close(self) -> None:
        """Release the engine."""
        self.world.close()

    @property
    def end(self) -> str:
        """Return the end of the run, ``tilted`` or ``duration``; empty while it runs."""
        if self.truth.tilt > radians(self.parameters.stop_when_tilted_deg):
            return 'tilted'
        if self._end_ns is not None and self.truth.stamp_ns >= self._end_ns:
            return 'duration'
        return ''

    @property
    def trajectory_hash(self) -> str:
        """Return the SHA-256 of the records of all samples so far, in hex."""
        return self._hash.hexdigest()

    def _take(self, truth: GroundTruth) -> GroundTruth:
        self.truth = truth
        self._hash.update(truth.record())
        return truth
