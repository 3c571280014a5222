"""Write a rosbag2 (MCAP) of raw serialized messages, without ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import yaml
from mcap.writer import CompressionType, Writer
from rosbags.typesys import Stores, get_typestore

from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_common.stamps import HISTORY

FLUSH_PERIOD = 1_000_000_000  # ns of simulated time that a killed recorder may lose
INFORMATION = 'rosbag2_bagfile_information'
METADATA, METADATA_KEY = 'rosbag2', 'serialized_metadata'  # record of rosbag2 in the MCAP file
_VERSION = 9  # of the rosbag2 metadata of Jazzy
_CHUNK = 1 << 20  # bytes
_FOREVER = {'sec': 2147483647, 'nsec': 4294967295}


class Definition(NamedTuple):
    """A message type as it is written into a bag."""

    encoding: str  # of MCAP: ros2msg or ros2idl; empty without a text
    text: str  # of the definition, with those of its fields
    digest: str  # RIHS01 hash of the type; empty if it is not known


class Recording:
    """A bag open for writing, with MCAP checksums; flushed after each simulated second.

    Args:
        folder: the bag's folder; it is created.

    Raises:
        KhrError: if the folder exists or cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._file = folder, folder / f'{folder.name}.mcap'
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._topics: dict[str, dict[str, Any]] = {}  # topic_metadata of rosbag2
        self.counts: dict[str, int] = {}
        self._flushed = self._last = 0
        self._first = 2**63 - 1
        try:
            folder.mkdir(mode=0o755, parents=True)
            self._stream = self._file.open('xb')
        except OSError as error:
            raise KhrError(
                f'folder: {str(folder)!r}: {error}; accepted: a new folder on a disk with room'
            ) from error
        self._writer: Any = Writer(  # partly untyped
            self._stream, _CHUNK, CompressionType.NONE, enable_crcs=True, enable_data_crcs=True
        )
        self._writer.start('ros2')

    def add_topic(
        self, topic: str, kind: str, latched: bool = False, foreign: Definition | None = None
    ) -> None:
        """Add a topic of message type ``kind`` such as ``sensor_msgs/msg/Imu``.

        Args:
            topic: its name.
            kind: its message type.
            latched: whether its last message is kept for late subscribers.
            foreign: definition of a type that is not one of ROS 2 Jazzy's own; ignored otherwise.

        Raises:
            KhrError: if the type is not one of ROS 2 Jazzy's own, and no definition is given.
        """
        if kind in self._store.types:
            text = self._store.generate_msgdef(kind, ros_version=2)[0]
            definition = Definition('ros2msg', text, self._store.hash_rihs01(kind))
        elif foreign is not None:
            definition = foreign
        else:
            raise KhrError(
                f'{topic}: type {kind} is not accepted; accepted: the message types of ROS 2 Jazzy'
            )
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(
                kind, definition.encoding, definition.text.encode()
            )
        profiles = [_qos(latched)]
        self._channels[topic] = self._writer.register_channel(
            topic, 'cdr', self._schemas[kind], {'offered_qos_profiles': _dump(profiles)}
        )
        self._topics[topic] = {
            'name': topic,
            'type': kind,
            'serialization_format': 'cdr',
            'offered_qos_profiles': profiles,
            'type_description_hash': definition.digest,
        }
        self.counts[topic] = 0

    def write(self, topic: str, data: bytes, time_ns: int) -> None:
        """Write one serialized message.

        Raises:
            OSError: if the disk takes no more.
        """
        self._writer.add_message(self._channels[topic], time_ns, data, time_ns)
        self._first, self._last = min(self._first, time_ns), max(self._last, time_ns)
        self.counts[topic] += 1
        if time_ns - self._flushed >= FLUSH_PERIOD:
            self._flushed = time_ns
            self._writer.flush()  # the operating system has it then: it survives a kill

    def write_text(self, topic: str, text: str, time_ns: int) -> None:
        """Write a text as a latched std_msgs/String."""
        kind = 'std_msgs/msg/String'
        if topic not in self._channels:
            self.add_topic(topic, kind, latched=True)
        message = self._store.types[kind](data=text)
        self.write(topic, bytes(self._store.serialize_cdr(message, kind)), time_ns)

    def close(self) -> None:
        """Finish the bag; it is readable from now on.

        Raises:
            OSError: if the disk takes no more.
        """
        information = self._information()
        with self._stream:
            self._writer.flush()
            self._writer.add_metadata(METADATA, {METADATA_KEY: _dump(information)})
            self._writer.finish()
        write_text(self._folder / 'metadata.yaml', _dump({INFORMATION: information}))

    def _information(self) -> dict[str, Any]:
        extent = {
            'duration': {'nanoseconds': max(0, self._last - self._first)},
            'starting_time': {'nanoseconds_since_epoch': self._first},
            'message_count': sum(self.counts.values()),
        }
        return extent | {
            'version': _VERSION,
            'storage_identifier': 'mcap',
            'relative_file_paths': [self._file.name],
            'topics_with_message_count': [
                {'topic_metadata': self._topics[topic], 'message_count': count}
                for topic, count in self.counts.items()
            ],
            'compression_format': '',
            'compression_mode': '',
            'files': [{'path': self._file.name} | extent],
            'custom_data': None,
            'ros_distro': 'jazzy',
        }


def _dump(value: Any) -> str:
    """Return a value as YAML without aliases, which rosbag2 does not write."""
    return yaml.dump(value, Dumper=_Dumper, sort_keys=False)


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return True


def _qos(latched: bool) -> dict[str, Any]:
    return {
        'history': 'keep_last',
        'depth': 1 if latched else HISTORY,
        'reliability': 'reliable',
        'durability': 'transient_local' if latched else 'volatile',
        'deadline': _FOREVER,
        'lifespan': _FOREVER,
        'liveliness': 'automatic',
        'liveliness_lease_duration': _FOREVER,
        'avoid_ros_namespace_conventions': False,
    }
