"""The controlled plant: the world behind the delay of the boards, with its trajectory hash.

The simulator node, a run without ROS and the Gymnasium environment share this class, so that all
give the same trajectory.
"""

from __future__ import annotations

import hashlib
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from math import radians

from khr_common.arithmetic import warn_unless_portable
from khr_common.errors import KhrError
from khr_sim.physics.body import Start
from khr_sim.physics.push import Push
from khr_sim.physics.truth import GroundTruth
from khr_sim.physics.world import World
from khr_sim.run_parameters import RunParameters


class Plant:
    """A world with control delay, end conditions and a hash of its trajectory.

    Answers are passed in the order of the samples; each acts ``control_delay`` periods after its
    sample. Until the first one acts the boards hold the initial postures.

    Args:
        parameters: of each robot; those of the first are of the run as well.
        starts: where each robot starts.
    """

    def __init__(
        self, parameters: Sequence[RunParameters], starts: Sequence[Start] = (Start(),)
    ) -> None:
        self.parameters = list(parameters)
        self._timed = [[Push.parse(text) for text in p.pushes if text] for p in parameters]
        self.world = World(parameters, starts)
        warn_unless_portable()
        self._hash = hashlib.sha256()
        self._end_ns = round(parameters[0].duration * 1e9) or None
        # of the coming periods: targets, rad, or the reason to end instead
        self._due: deque[Sequence[Sequence[float]] | str] = deque()
        self.truths: list[GroundTruth]

    def start(self, postures: Sequence[Sequence[float]]) -> list[GroundTruth]:
        """Put the robots on the ground in their postures, 17 angles in rad each, at time zero."""
        self._hash = hashlib.sha256()
        self._due = deque[Sequence[Sequence[float]] | str](
            [postures] * self.parameters[0].control_delay
        )
        truths = self._take(self.world.reset(postures))
        for number, pushes in enumerate(self._timed):
            for push in pushes:
                self.world.push(push, number)
        return truths

    def answer(self, targets: Sequence[Sequence[float]], end: str = '') -> None:
        """Queue the answer to the next sample: 17 joint angles in rad of each robot.

        Args:
            targets: of the robots.
            end: the reason to end the run when the answer is to act; by default it goes on.
        """
        self._due.append(end or targets)

    @property
    def ready(self) -> bool:
        """Return whether the answer for the next period is queued."""
        return bool(self._due)

    def advance(self) -> list[GroundTruth]:
        """Simulate one control period towards the next queued answer.

        Raises:
            KhrError: if the answer is missing, or is not 17 finite numbers of each robot.
        """
        targets = self._due.popleft() if self._due else ''
        if isinstance(targets, str):
            raise KhrError('answer: missing; accepted: one to each sample, before it acts')
        return self._take(self.world.advance(targets))

    def configure(self, parameters: Sequence[RunParameters]) -> None:
        """Apply changed parameters of each robot."""
        self.parameters = list(parameters)
        self.world.configure(parameters)

    def reseed(self, parameters: Sequence[RunParameters]) -> bool:
        """Apply parameters for the next start and return True if only the seeds differ."""
        pairs = [*zip(self.parameters, parameters, strict=True)]
        if any(replace(new, seed=old.seed) != old for old, new in pairs):
            return False
        self.parameters = list(parameters)
        for body, own in zip(self.world.bodies, parameters, strict=True):
            body.parameters = own
        return True

    def close(self) -> None:
        """Release the engine."""
        self.world.close()

    @property
    def end(self) -> str:
        """Return the end of the run; empty while it goes on.

        It is ``tilted``, ``duration``, or the reason queued by :meth:`answer`.
        """
        for truth, own in zip(self.truths, self.parameters, strict=True):
            if truth.tilt > radians(own.stop_when_tilted_deg):
                return 'tilted'
        if self._end_ns is not None and self.truths[0].stamp_ns >= self._end_ns:
            return 'duration'
        return self._due[0] if self._due and isinstance(self._due[0], str) else ''

    @property
    def trajectory_hash(self) -> str:
        """Return the SHA-256 of the records of all samples so far, in hex.

        The records of a sample follow one another in the order of the robots.
        """
        return self._hash.hexdigest()

    def _take(self, truths: list[GroundTruth]) -> list[GroundTruth]:
        self.truths = truths
        for truth in truths:
            self._hash.update(truth.record())
        return truths
