"""The scene of a sample: robot, slope, forces and support; the newest one of a live run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, sin
from typing import Any

import numpy as np

from khr_bringup.balance import Balance, BalanceModel
from khr_common.block import Numbers, Signals
from khr_common.interfaces import (
    FOOT_FORCES,
    JOINT_STATES,
    TRUE_FORCES,
    TRUE_INCLINATION,
    TRUE_POSE,
    Topic,
)
from khr_common.rotation import Array, pitch_of
from khr_common.stamps import ExactTimeSynchronizer, TimeJumpError
from khr_description.robot import Robot
from khr_sim.parameters import SimulatorParameters
from khr_sim.physics.contact import SIDES
from khr_sim.run_parameters import RunParameters

NEEDED = (JOINT_STATES, TRUE_POSE, TRUE_INCLINATION, *TRUE_FORCES)
OF_SOLES = ('surface', 'pad_distance')  # they set the width of the soles


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The scene of one sample, in odom: z upward, the slope through the origin; m, rad, N."""

    base: tuple[float, ...]  # pose of base_link: x y z, quaternion x y z w
    joints: tuple[float, ...]  # 17 angles
    inclination: float  # of the slope, positive if it descends along x
    balance: Balance  # centre of mass, capture point, centre of pressure and support
    forces: Array  # of l_toe l_heel r_toe r_heel in their frames, N, (4, 3)
    torso: Array  # middle of the torso, at which pushes are shown, (3,)

    @property
    def numbers(self) -> tuple[float, ...]:
        """Return margins, m, and lean, rad, in the order of the charts."""
        return (*self.balance.margins, pitch_of(*self.base[3:]))

    @property
    def way(self) -> Array:
        """Return the projection of the torso's frame onto the slope, along its normal, (3,)."""
        normal = np.array([sin(self.inclination), 0.0, cos(self.inclination)])
        position = np.array(self.base[:3])
        return np.asarray(position - (position @ normal) * normal)


class SnapshotBuilder:
    """Compute scenes of one robot.

    Args:
        robot: its description.
        parameters: of the simulator, for the width of the soles.
    """

    def __init__(self, robot: Robot, parameters: SimulatorParameters) -> None:
        self._robot = robot
        self._model = BalanceModel(robot, parameters)

    def build(
        self, signals: Signals, before: Balance | None = None, period: float = 0.0
    ) -> Snapshot:
        """Return the scene of a sample.

        Args:
            signals: those of NEEDED.
            before: balance at an earlier sample, for the velocity of the centre of mass.
            period: time since then, s.
        """
        base = tuple(signals[TRUE_POSE])
        joints = tuple(signals[JOINT_STATES])
        (inclination,) = signals[TRUE_INCLINATION]
        forces = np.array([signals[topic] for topic in TRUE_FORCES])
        balance = self._model.at(base, joints, inclination, forces[:, 2].tolist(), before, period)
        torso = balance.poses['base_link'] @ (0.0, 0.0, 0.08, 1.0)
        return Snapshot(base, joints, inclination, balance, forces, torso[:3])

    def completed(self, signals: Signals) -> Signals:
        """Return the signals of NEEDED where no truth is published, as on a real robot.

        The torso is drawn upright over its lower sole and the ground level, with the forces of the
        sensors; nothing else is measured.

        Args:
            signals: of the joints at least.
        """
        poses = self._robot.poses(tuple(signals[JOINT_STATES]))
        lowest = min(float(poses[f'{side}_sole'][2, 3]) for side in SIDES)
        read = [signals.get(topic, (0.0, 0.0, 0.0)) for topic in FOOT_FORCES]
        return {
            TRUE_POSE: (0.0, 0.0, -lowest, 0.0, 0.0, 0.0, 1.0),
            TRUE_INCLINATION: (0.0,),
            **dict(zip(TRUE_FORCES, read, strict=True)),
            **signals,
        }


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
