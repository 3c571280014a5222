"""Bags with invented messages, of the types that a run records."""

import json

from rosbags.typesys import Stores, get_typestore

from khr_analysis.recording import Recording
from khr_common.interfaces import SCENARIO
from khr_common.statuses import AFTER, CHANGED

STORE = get_typestore(Stores.ROS2_JAZZY)
TYPES = {name.rsplit('/', 1)[-1]: kind for name, kind in STORE.types.items()}


def state(message='finished', **values):
    pairs = [TYPES['KeyValue'](key=key, value=value) for key, value in values.items()]
    return TYPES['DiagnosticStatus'](
        level=0, name='simulator', message=message, hardware_id='', values=pairs
    )


def reported(node, name, value, after_ns):
    """Return what a node says of a change of its parameters."""
    values = {AFTER: str(after_ns), name: json.dumps(value)}
    pairs = [TYPES['KeyValue'](key=key, value=text) for key, text in values.items()]
    status = TYPES['DiagnosticStatus'](
        level=0, name=f'{node[1:]}{CHANGED}', message='', hardware_id='', values=pairs
    )
    header = TYPES['Header'](stamp=TYPES['Time'](sec=0, nanosec=0), frame_id='')
    return TYPES['DiagnosticArray'](header=header, status=[status])


def push(at=0.0):
    vector = TYPES['Vector3'](x=1.0, y=0.0, z=0.0)
    stamp = TYPES['Time'](sec=0, nanosec=round(at * 1e9))
    header = TYPES['Header'](stamp=stamp, frame_id='odom')
    return TYPES['WrenchStamped'](
        header=header, wrench=TYPES['Wrench'](force=vector, torque=vector)
    )


def make_bag(folder, text, *messages):
    """Write a bag with a scenario and (topic, message)s, or (topic, message, time in ns)s."""
    recording = Recording(folder / 'bag')
    if text is not None:
        recording.write_text(SCENARIO.name, text, 0)
    for topic, message, *time in messages:
        if topic not in recording.counts:
            recording.add_topic(topic, message.__msgtype__)
        recording.write(
            topic, bytes(STORE.serialize_cdr(message, message.__msgtype__)), *(time or [0])
        )
    recording.close()
    return folder
