"""The bag of a round: the topics of each robot in its namespace, and one clock."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from khr_analysis.outcome_values import values_of
from khr_analysis.recording import Recording
from khr_bringup.bout.bout import Bout
from khr_bringup.bout.result import Round
from khr_bringup.node_registry import spec_of
from khr_bringup.offline import ControlLoop
from khr_common.cdr import MessageTemplate
from khr_common.interfaces import FINISHED, OUTCOME, SCENARIO, STATE, Topic
from khr_common.nodes.messages import Output, blank_message, serialized, status
from khr_description.robot import Robot
from khr_sim.nodes.truth_publisher import TruthPublisher
from khr_sim.physics.truth import GroundTruth


class RoundBag:
    """Write the bag of a round, in a new folder, while it runs, without a graph."""

    def __init__(self, folder: Path, bout: Bout, text: str) -> None:
        self._recording = Recording(folder)
        self._recording.write_text(SCENARIO.name, text, 0)
        self._now_ns = 0
        self._topics: dict[str, list[Topic]] = {}
        self._outputs: dict[tuple[str, Topic], Output] = {}
        self._truths: dict[str, TruthPublisher] = {}
        for number, (robot, scenario) in enumerate(bout.robots.items()):
            self._truths[robot] = TruthPublisher(self, Robot.load().urdf, robot, clock=not number)
            self._truths[robot].describe()
            specs = [spec_of(node) for node in scenario.nodes]
            self._topics[robot] = [
                topic
                for spec in specs
                if spec.block is not None
                for topic in spec.publishes
                if topic.flow == 'period'
            ]
            for topic in self._topics[robot]:
                self._outputs[robot, topic] = self.output(topic.under(robot))

    def take(self, truths: Mapping[str, GroundTruth], loops: Mapping[str, ControlLoop]) -> None:
        """Write a sample."""
        for robot, truth in truths.items():
            self._now_ns = truth.stamp_ns
            self._truths[robot].publish(truth)
            for topic in self._topics[robot]:
                output = self._outputs[robot, topic]
                output.fill(truth.stamp_ns, loops[robot].signals[topic])
                output.send()

    def close(self, ended: Round | None) -> None:
        """Write the end of the round, if it has one, and finish the bag."""
        for robot, outcome in ended.outcomes.items() if ended else ():
            assert ended is not None
            verdict = {name: str(value) for name, value in values_of(outcome).items()}
            self.publisher(OUTCOME.under(robot)).publish(
                status('monitor', outcome.verdict, verdict)
            )
            values = {
                'time_ns': str(self._now_ns),
                'end': ended.decision.reason,
                'trajectory_hash': ended.trajectory_hash,
            }
            self.publisher(STATE.under(robot)).publish(status('simulator', FINISHED, values))
        self._recording.close()

    def publisher(self, topic: Topic) -> Any:
        """Return a publisher of a topic, which is added to the bag."""
        name = f'/{topic.name}'
        self._recording.add_topic(name, topic.kind, topic.flow == 'latched')
        return _Publisher(self, name)

    def output(self, topic: Topic, message: Any = None) -> Output:
        """Return an output of a periodic topic."""
        form = MessageTemplate(serialized(message or blank_message(topic)))
        return Output(self.publisher(topic), form)

    def write(self, name: str, data: bytes) -> None:
        """Write a message at the time of the last sample."""
        self._recording.write(name, data, self._now_ns)


class _Publisher:
    """A publisher of one topic that writes to the bag."""

    def __init__(self, bag: RoundBag, name: str) -> None:
        self._bag, self._name = bag, name

    def publish(self, message: Any) -> None:
        """Write a message, or its bytes."""
        self._bag.write(self._name, message if isinstance(message, bytes) else serialized(message))
