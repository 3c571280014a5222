"""Comparison of a bag, and the files of its run, with the repeated run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from khr_analysis.outcome import MonitorParameters
from khr_bringup.node_registry import registry
from khr_bringup.offline import ControlLoop
from khr_bringup.recorded.bags import Messages
from khr_bringup.result import FILE, Result, read_outcome
from khr_common import cdr
from khr_common.errors import KhrError
from khr_common.interfaces import JOINT_STATES, TRUE_POSE, Topic
from khr_sim.physics.truth import SIGNALS, GroundTruth

TAIL_NS = 100_000_000  # of a run that was interrupted: its last answers may not have come
# A run uses only the angles of joint_states and the pose of odom; their speeds are compared too.
_WHOLE = {JOINT_STATES: cdr.joint_motion, TRUE_POSE: cdr.pose_and_twist}


def numbers_of(topic: Topic) -> cdr.Reader:
    """Return the decoder of all numbers of a periodic topic."""
    return _WHOLE.get(topic) or cdr.numbers_of(topic)


def compared_topics() -> tuple[Topic, ...]:
    """Return the topics that can be compared: the truth, and the outputs of the blocks."""
    answers = (
        topic
        for node in registry().values()
        if node.spec.block is not None
        for topic in node.spec.publishes
        if topic.flow == 'period'
    )
    return tuple(dict.fromkeys((*SIGNALS, *answers)))


class SideBySide:
    """Compare periodic topics, number by number.

    Attributes:
        instants: number of compared samples.
        topics: how many of the bag hold samples.
    """

    def __init__(self, signals: Messages) -> None:
        self._samples = {topic: iter(signals[topic]) for topic in signals if len(signals[topic])}
        self._differing: dict[Topic, int] = {}
        self._ended: dict[Topic, int] = {}
        self.instants, self.topics = 0, len(self._samples)

    def take(self, truth: GroundTruth, loop: ControlLoop, *_: object) -> None:
        """Compare the next sample."""
        self.instants += 1
        speeds = truth.speeds()
        for topic, samples in self._samples.items():
            found = next(samples, None)
            if found is None:
                self._ended.setdefault(topic, truth.stamp_ns)
                continue
            numbers = (*loop.signals.get(topic, ()), *speeds.get(topic, ()))
            if found != (truth.stamp_ns, numbers):
                self._differing.setdefault(topic, truth.stamp_ns)

    def differences(self, end_ns: int, interrupted: bool) -> list[str]:
        """Describe the differing topics, each from its first differing sample on; call it last."""
        until = end_ns - TAIL_NS if interrupted else end_ns
        ended = {topic: at for topic, at in self._ended.items() if at <= until}
        beyond = {topic: end_ns for topic, samples in self._samples.items() if next(samples, None)}
        return [
            f'{topic.name}: {what} t = {at / 1e9:.3f} s'
            for what, found in (
                ('differs from', self._differing),
                ('missing from', ended),
                ('goes on after', beyond),
            )
            for topic, at in found.items()
        ]


def differences_beside(folder: Path, scenario: str, hashed: str, repeated: Result) -> list[str]:
    """Describe the differences of the files in the folder of the run.

    Args:
        folder: of the run.
        scenario: its text, as the bag has it.
        hashed: the trajectory hash in the bag.
        repeated: the run, repeated, with a verdict by the truth.
    """
    found = []
    scenarios = sorted(folder.glob('scenario*.yaml'))
    if scenarios and scenario.encode() not in [path.read_bytes() for path in scenarios]:
        found.append(f'{scenarios[-1]}: not the scenario that the bag has')
    path = folder / FILE
    try:
        stored = read_outcome(folder).to_json() if path.exists() else None
        expected: dict[str, Any] = {'trajectory_hash': hashed}
        if repeated.scenario.table(MonitorParameters).judge_by == 'truth':
            expected |= {'verdict': repeated.verdict, **repeated.quantities}
        if stored is not None:
            found += [
                f'{path}: {name}: {stored.get(name)}, by the bag {value}'
                for name, value in expected.items()
                if stored.get(name) != value
            ]
    except KhrError as error:
        found.append(str(error))
    return found
