"""A rosbag2 recording (MCAP) from raw serialized messages, without ROS."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_typestore

from khr_analysis.checksums import Checksums
from khr_common.errors import KhrError
from khr_common.files import write_text
from khr_common.stamps import HISTORY

_FOREVER = QosTime(2147483647, 4294967295)
WRITER, DISTRIBUTION = 'ros_distro: rosbags', 'ros_distro: jazzy'
FLUSH_PERIOD = 1_000_000_000  # ns of simulated time that a recorder which is killed may lose


class Recording:
    """One bag that is being written; what it holds is on the disk after each simulated second.

    Args:
        folder: the bag's folder; it is created.

    Raises:
        KhrError: if the folder exists or cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        self._store = get_typestore(Stores.ROS2_JAZZY)
        self._connections: dict[str, Connection] = {}
        self.counts: dict[str, int] = {}
        self._flushed = 0
        self._writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            self._writer.open()
        except (WriterError, OSError) as error:
            raise KhrError(
                f'folder: {str(folder)!r}: {error}; accepted: a new folder on a disk with room'
            ) from error
        self._storage: Any = self._writer.storage
        self._checksums = Checksums(self._storage)

    def add_topic(self, topic: str, kind: str, latched: bool = False) -> None:
        """Add a topic of message type ``kind`` such as ``sensor_msgs/msg/Imu``.

        Raises:
            KhrError: if the type is not one of ROS 2 Jazzy's own.
        """
        if kind not in self._store.types:
            raise KhrError(
                f'{topic}: type {kind} is not accepted; accepted: the message types of ROS 2 Jazzy'
            )
        self._connections[topic] = self._writer.add_connection(
            topic, kind, typestore=self._store, offered_qos_profiles=[_qos(latched)]
        )
        self.counts[topic] = 0

    def write(self, topic: str, data: bytes, time_ns: int) -> None:
        """Write one serialized message.

        Raises:
            OSError: if the disk takes no more.
        """
        self._writer.write(self._connections[topic], time_ns, data)
        self.counts[topic] += 1
        if time_ns - self._flushed >= FLUSH_PERIOD:
            self._flushed = time_ns
            self._storage.close_chunk()  # it is with the system then, and survives a kill

    def write_text(self, topic: str, text: str, time_ns: int) -> None:
        """Write a text as a latched std_msgs/String."""
        kind = 'std_msgs/msg/String'
        if topic not in self._connections:
            self.add_topic(topic, kind, latched=True)
        message = self._store.types[kind](data=text)
        self.write(topic, bytes(self._store.serialize_cdr(message, kind)), time_ns)

    def close(self) -> None:
        """Finish the bag; it is readable from now on.

        Raises:
            OSError: if the disk takes no more.
        """
        finish = self._storage.close

        def close(version: int, text: str) -> None:
            # The writer knows of no distribution; the one whose messages it holds stands for it.
            finish(version, text.replace(WRITER, DISTRIBUTION))
            self._checksums.seal()

        self._storage.close = close
        self._writer.close()
        if self._writer.metapath.is_file():
            text = self._writer.metapath.read_text(encoding='utf-8')
            write_text(self._writer.metapath, text.replace(WRITER, DISTRIBUTION))


def _qos(latched: bool) -> Qos:
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    return Qos(
        QosHistory.KEEP_LAST,
        1 if latched else HISTORY,
        QosReliability.RELIABLE,
        durability,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        False,
    )
