"""The robot of a live run: described once, posed by the newest complete sample."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from khr_common.block import Numbers
from khr_common.interfaces import JOINT_STATES, Topic
from khr_common.stamps import ExactTimeSynchronizer, TimeJumpError
from khr_description.robot import Robot
from khr_sim.run_parameters import RunParameters
from khr_view.model.snapshot import NEEDED, Snapshot, SnapshotBuilder

OF_SOLES = ('surface', 'pad_distance')  # they set the width of the soles


class LiveScene:
    """Keep the newest signals, and build scenes of complete samples.

    Messages may be lost, or arrive between two polls: forces of one sample would be drawn away from
    the soles of another.

    Attributes:
        signals: the newest of each topic.
        snapshot: the newest scene; None before there is one.
        truth: whether the true pose of the robot is published.
        pushable: whether the driver takes pushes.
    """

    def __init__(self) -> None:
        self.signals: dict[Topic, Numbers] = {}
        self.snapshot: Snapshot | None = None
        self.truth = self.pushable = True
        self._samples = ExactTimeSynchronizer[Topic](NEEDED)
        self._stamp_ns = 0  # of the newest complete sample
        self._robot: Robot | None = None
        self._builder: SnapshotBuilder | None = None

    def describe(self, urdf: str) -> Robot | None:
        """Take the description of the robot; return the robot if it is the first."""
        if self._robot is not None:
            return None
        self._robot = Robot(urdf)
        self.configure({})
        return self._robot

    def configure(self, parameters: Mapping[str, Any]) -> None:
        """Take parameters of the simulator, as far as they are known."""
        own = {name: parameters[name] for name in OF_SOLES if name in parameters}
        if self._robot is not None:
            self._builder = SnapshotBuilder(self._robot, replace(RunParameters(), **own))

    def take(self, topic: Topic, stamp_ns: int, numbers: Numbers) -> Numbers | None:
        """Take a sample of a topic.

        Returns:
            Margins and lean of the sample, as on ``BALANCE``, if it completes one.
        """
        self.signals[topic] = numbers
        if topic not in NEEDED:
            return None
        try:
            complete = self._samples.put(topic, stamp_ns, numbers)
        except TimeJumpError:  # another run, for a page that was started by hand
            self._samples, self.snapshot = ExactTimeSynchronizer[Topic](NEEDED), None
            complete = self._samples.put(topic, stamp_ns, numbers)
        if complete is None or self._builder is None:
            return None
        before = self.snapshot.balance if self.snapshot else None
        period = (stamp_ns - self._stamp_ns) / 1e9
        self.snapshot = self._builder.build(complete, before, period)
        self._stamp_ns = stamp_ns
        return self.snapshot.numbers

    def build(self) -> Snapshot | None:
        """Return the scene of the newest complete sample; None before there is one.

        Without a true pose it shows the newest signals.
        """
        if self._builder is not None and not self.truth and JOINT_STATES in self.signals:
            self.snapshot = self._builder.build(self._builder.completed(self.signals))
        return self.snapshot
