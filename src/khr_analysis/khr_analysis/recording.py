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

from khr_analysis.errors import AnalysisError

_FOREVER = QosTime(2147483647, 4294967295)
FLUSH_PERIOD = 1_000_000_000  # ns of simulated time that a recorder which is killed may lose


def numbered(folder: str, run: int) -> Path:
    """Return the bag of a run that follows others in one graph: ``bag``, ``bag_2``, ``bag_3``."""
    return Path(folder if run == 1 else f'{folder}_{run}')


class Recording:
    """One bag that is being written; what it holds is on the disk after each simulated second.

    Args:
        folder: the bag's folder; it is created.

    Raises:
        AnalysisError: if the folder exists or cannot be made.
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
            raise AnalysisError(
                f'folder: {str(folder)!r}: {error}; accepted: a new folder on a disk with room'
            ) from error

    def add_topic(self, topic: str, kind: str, latched: bool = False) -> None:
        """Add a topic of message type ``kind`` such as ``sensor_msgs/msg/Imu``.

        Raises:
            AnalysisError: if the type is not one of ROS 2 Jazzy's own.
        """
        if kind not in self._store.types:
            raise AnalysisError(
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
            self._flush()

    def write_text(self, topic: str, text: str, time_ns: int) -> None:
        """Write a text as a latched std_msgs/String."""
        kind = 'std_msgs/msg/String'
        if topic not in self._connections:
            self.add_topic(topic, kind, latched=True)
        message = self._store.types[kind](data=text)
        self.write(topic, bytes(self._store.serialize_cdr(message, kind)), time_ns)

    def _flush(self) -> None:
        """End the chunk that is being filled, and pass it to the system: it survives a kill."""
        storage: Any = self._writer.storage
        storage.close_chunk()
        storage.bio.flush()

    def close(self) -> None:
        """Finish the bag; it is readable from now on.

        Raises:
            OSError: if the disk takes no more.
        """
        self._writer.close()


def _qos(latched: bool) -> Qos:
    durability = QosDurability.TRANSIENT_LOCAL if latched else QosDurability.VOLATILE
    return Qos(
        QosHistory.KEEP_LAST,
        10,
        QosReliability.RELIABLE,
        durability,
        _FOREVER,
        _FOREVER,
        QosLiveliness.AUTOMATIC,
        _FOREVER,
        False,
    )
