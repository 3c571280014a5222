"""The recorder: its parameters, topics and folder, and its specification."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast, get_args

from khr_common import ParameterError, fixed, parameter
from khr_common import interfaces as topics
from khr_common.block import NodeSpec
from khr_common.interfaces import NAME, Flow, Topic

# Topics of every run; nodes add their own topics.
OF_EVERY_RUN = (
    topics.CLOCK,
    topics.JOINT_STATES,
    topics.TRUE_POSE,
    topics.TRUE_RATE,
    topics.TRUE_SOLES,
    topics.TRUE_INCLINATION,
    *topics.TRUE_FORCES,
    topics.GYRO,
    *topics.FOOT_FORCES,
    topics.JOINT_REFERENCE,
    topics.ANKLE_CORRECTION,
    topics.HIP_CORRECTION,
    topics.ROBOT_DESCRIPTION,
    *((topics.TF, topics.TF_STATIC) if topics.TF_AVAILABLE else ()),
    topics.STATE,
    topics.READY,
    topics.OUTCOME,
    topics.SPECTRUM,
    topics.PEAKS,
    topics.PUSH,
    topics.PUSHED,
    topics.DIAGNOSTICS,
    topics.LOG,
)


@dataclass(frozen=True)
class RecorderParameters:
    """The parameter table of the recorder."""

    folder: str = parameter(
        'bag', 'Folder of the rosbag2 to write; it must not exist yet.', wiring=True
    )
    scenario_file: str = parameter(
        '', 'Parameter file of the run, stored in the bag on /scenario.', wiring=True
    )
    topics: tuple[str, ...] = parameter(
        ('',),
        'Topics to record, each as name, message type, and "period" (one message in every control '
        'period: the run waits for it), "latched" or "event"; those of every run if empty.',
        wiring=True,
    )
    extra_topics: tuple[str, ...] = fixed(('',), 'Further topics to record, in the same form.')

    def __post_init__(self) -> None:
        self.recorded()

    def recorded(self) -> tuple[Topic, ...]:
        """Return the topics to record.

        Raises:
            ParameterError: if name, type or flow of a topic is malformed.
        """
        stated = tuple(_topic(line) for line in self.topics if line)
        return (stated or OF_EVERY_RUN) + tuple(_topic(line) for line in self.extra_topics if line)


RECORDER = NodeSpec(
    'recorder',
    'khr_analysis',
    RecorderParameters,
    subscribes=OF_EVERY_RUN,
    publishes=(topics.DIAGNOSTICS, topics.READY),
    node='khr_analysis.nodes.recorder:RecorderNode',
    listens=True,
)


def _topic(line: str) -> Topic:
    name, kind, flow = (line.split() + [''] * 3)[:3]
    if not NAME.fullmatch(name) or kind.count('/') != 2 or flow not in get_args(Flow):
        raise ParameterError.refused(
            'topics', line, f'NAME PACKAGE/msg/TYPE {"|".join(get_args(Flow))}'
        )
    return Topic(name, kind, '', cast(Flow, flow))
