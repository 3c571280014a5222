"""Recordings as other tools write them: rosbags, mcap, and rosbag2 of other distributions."""

import math
import shutil
import sqlite3
from itertools import pairwise
from pathlib import Path

import numpy as np
import yaml
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
JAZZY = get_typestore(Stores.ROS2_JAZZY)
TYPES = {name.rsplit('/', 1)[-1]: kind for name, kind in STORE.types.items()}
EPOCH = 1_700_000_000_000_000_000  # ns
IMU = 'sensor_msgs/msg/Imu'
POLICIES = """- history: 3
  depth: 0
  reliability: 1
  durability: 2
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false"""


def header(stamp_ns):
    stamp = TYPES['Time'](*divmod(int(stamp_ns), 10**9))
    return TYPES['Header'](stamp, 'imu')


def vector(x=0.0, y=0.0, z=0.0):
    return TYPES['Vector3'](x, y, z)


def message(kind, stamp_ns, value):
    """Return a message whose analysed number, along its default axis, is a value."""
    if kind == 'Imu':
        none = np.zeros(9)
        turned = TYPES['Quaternion'](0.0, 0.0, 0.0, 1.0)
        rate = vector(y=value)
        return TYPES[kind](header(stamp_ns), turned, none - 1, rate, none, vector(z=9.81), none)
    if kind == 'JointState':
        none = np.zeros(0)
        return TYPES[kind](header(stamp_ns), ['knee', 'hip'], np.array([value, 1.0]), none, none)
    if kind == 'WrenchStamped':
        return TYPES[kind](header(stamp_ns), TYPES['Wrench'](vector(z=value), vector()))
    if kind == 'Vector3Stamped':
        return TYPES[kind](header(stamp_ns), vector(y=value))
    return TYPES['Float64'](value)


def tone(frequency, rate, seconds=4.0, kind='Imu'):
    """Return (time of recording in ns, message)s of a tone, in Hz, sampled at a rate, in Hz."""
    made = []
    for number in range(int(seconds * rate)):
        at = number / rate
        stamp_ns = EPOCH + round(at * 1e9)
        value = math.sin(math.tau * frequency * at)
        made.append((stamp_ns, message(kind, stamp_ns, value)))
    return made


def write(folder, messages, topic='/imu/data', *, plugin='mcap', compressed='none', version=9):
    """Write a rosbag2 by rosbags; messages are (time, message)s or (time, message, topic)s."""
    writer = Writer(folder, version=version, storage_plugin=getattr(StoragePlugin, plugin.upper()))
    writer.set_compression(getattr(CompressionMode, compressed.upper()), CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for time_ns, each, *other in messages:
            name = other[0] if other else topic
            if name not in connections:
                connections[name] = writer.add_connection(name, each.__msgtype__, typestore=STORE)
            data = STORE.serialize_cdr(each, each.__msgtype__)
            writer.write(connections[name], time_ns, data)
    return Path(folder)


def write_mcap(
    file, messages, topic='/imu/data', profile='ros2', definition=True, kind=IMU, **options
):
    """Write one MCAP file by the library mcap, with any of its options.

    The messages are of Imu; ``kind`` is the name that their type has in the file.
    """
    with Path(file).open('wb') as stream:
        writer = McapWriter(stream, **options)
        writer.start(profile)
        text = STORE.generate_msgdef(IMU, ros_version=2)[0].encode() if definition else b''
        schema = writer.register_schema(kind, 'ros2msg' if definition else '', text)
        channel = writer.register_channel(topic, 'cdr', schema)
        for time_ns, each in messages:
            data = bytes(STORE.serialize_cdr(each, each.__msgtype__))
            writer.add_message(channel, time_ns, data, time_ns)
        writer.finish()
    return Path(file)


def wrapped(folder, messages, plugin):
    """Write a rosbag2 of messages of a driver's own type, each with an Imu in its field ``imu``."""
    own = get_typestore(Stores.ROS2_HUMBLE)
    kind = 'driver_msgs/msg/Reading'
    text = 'std_msgs/Header header\nsensor_msgs/Imu imu\nstring raw'
    own.register(get_types_from_msg(text, kind))
    writer = Writer(folder, version=9, storage_plugin=getattr(StoragePlugin, plugin.upper()))
    with writer:
        connection = writer.add_connection('/imu', kind, typestore=own)
        for time_ns, each in messages:
            reading = own.types[kind](each.header, each, '$VNYMR')
            writer.write(connection, time_ns, own.serialize_cdr(reading, kind))
    return Path(folder)


def rewritten(bag, folder, name=lambda topic: topic, parts=1, **options):
    """Write a rosbag2 again by rosbags, with other names of topics, in one file or several.

    The options are those of :func:`write`.
    """
    with Reader(bag) as reader:
        messages = [
            (time_ns, JAZZY.deserialize_cdr(data, connection.msgtype), name(connection.topic))
            for connection, time_ns, data in reader.messages()
        ]
    if parts == 1:
        return write(folder, messages, **options)
    bounds = [len(messages) * number // parts for number in range(parts + 1)]
    return split(folder, [messages[a:b] for a, b in pairwise(bounds)], **options)


def split(folder, parts, **options):
    """Write a rosbag2 in several files, as rosbag2 does at a limit of size or duration."""
    folder.mkdir()
    names, whole, topics = [], [], {}
    for number, messages in enumerate(parts):
        part = write(folder / f'part_{number}', messages, **options)
        about = yaml.safe_load((part / 'metadata.yaml').read_text())
        whole.append(about['rosbag2_bagfile_information'])
        (file,) = (each for each in part.iterdir() if each.name != 'metadata.yaml')
        ending = file.name.partition('.')[2]
        names.append(f'split_{8 + number}.{ending}')
        shutil.move(file, folder / names[-1])
        shutil.rmtree(part)
        for entry in whole[-1]['topics_with_message_count']:
            known = topics.setdefault(
                entry['topic_metadata']['name'], entry | {'message_count': 0}
            )
            known['message_count'] += entry['message_count']
    first = whole[0] | {
        'relative_file_paths': names,
        'topics_with_message_count': list(topics.values()),
        'message_count': sum(each['message_count'] for each in whole),
        'files': [],
    }
    (folder / 'metadata.yaml').write_text(yaml.safe_dump({'rosbag2_bagfile_information': first}))
    return folder


def as_humble(folder):
    """Change metadata to those of ROS 2 Humble, and SQLite to its tables without types."""
    for file in folder.glob('*.db3'):
        with sqlite3.connect(file) as database:
            database.executescript(
                'DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata;'
                'ALTER TABLE topics DROP COLUMN type_description_hash;'
            )
        database.close()
    path = folder / 'metadata.yaml'
    about = yaml.safe_load(path.read_text())
    information = about['rosbag2_bagfile_information']
    information['version'] = 5
    for key in ('ros_distro', 'custom_data'):
        information.pop(key, None)
    for entry in information['topics_with_message_count']:
        entry['topic_metadata'].pop('type_description_hash', None)
        entry['topic_metadata']['offered_qos_profiles'] = POLICIES
    path.write_text(yaml.safe_dump(about))
    return folder
