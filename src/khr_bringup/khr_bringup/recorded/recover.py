"""Recover the bag of a killed recorder, or a damaged one: write its whole messages again."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from rosbags.interfaces import (
    Connection,
    ConnectionExtRosbag2,
    MessageDefinitionFormat,
    QosDurability,
)
from rosbags.rosbag2 import Reader

from khr_analysis.recording import Definition, Recording
from khr_bringup.recorded.bags import bag_of
from khr_bringup.recorded.integrity import check_bag
from khr_bringup.recorded.storage import METADATA, files_of, is_intact, is_recording, opened
from khr_common.errors import KhrError, one_line

ENCODINGS = {  # of definitions, as MCAP names them
    MessageDefinitionFormat.NONE: '',
    MessageDefinitionFormat.MSG: 'ros2msg',
    MessageDefinitionFormat.IDL: 'ros2idl',
}


@dataclass(frozen=True)
class Recovered:
    """A recovered bag: its messages, its last time in s, and the place of the damaged bag."""

    bag: Path
    messages: int
    seconds: float
    kept: Path
    damaged: int = 0  # chunks that were left out


def recover(bag: Path) -> Recovered | None:
    """Write a cut or damaged bag again with all whole messages; the damaged bag is kept.

    Args:
        bag: the bag, an MCAP file of one, or the folder of the run that holds it.

    Returns:
        The recovered bag, in one file; None if the bag is whole.

    Raises:
        KhrError: if it is no bag, holds no whole message, or has been recovered before.
        OSError: if the new bag cannot be written; the old one is then as it was.
    """
    place = bag_of(bag)
    alone = place.is_file() and place.suffix == '.mcap'
    if not (alone or (place.is_dir() and is_recording(place))):
        raise KhrError(
            f'{bag}: no bag; accepted: a rosbag2 folder, an MCAP file, or the folder of a run'
        )
    if _is_whole(place):
        return None
    if alone and (place.parent / METADATA).is_file():  # which would not fit the new file
        raise KhrError(f'{bag}: a file of a bag; accepted: its folder, {place.parent}')
    kept = place.with_name(f'{place.name}.cut')
    if kept.exists():
        raise KhrError(f'{kept}: exists; accepted: a bag that has not been recovered before')
    with TemporaryDirectory(dir=place.parent, prefix='.recover-') as folder:
        new = Path(folder) / place.name
        messages, end_ns, damaged = _rewrite(bag, place, new)
        place.rename(kept)
        shutil.move(new / f'{new.name}.mcap' if alone else new, place)
    return Recovered(place, messages, end_ns / 1e9, kept, damaged)


def _is_whole(place: Path) -> bool:
    """Return whether a bag can be read to its end and is as it was written, as by verify."""
    try:
        check_bag(place)
        with Reader(place) as reader:
            read, stated = sum(1 for _ in reader.messages()), reader.message_count
        intact = all(is_intact(file) for file in files_of(place) if file.suffix == '.mcap')
        return intact and read == stated
    except Exception:  # a damaged bag fails in many ways inside the reader
        return False


def _rewrite(bag: Path, place: Path, new: Path) -> tuple[int, int, int]:
    """Return how many messages were written, the time of the last, ns, and the damaged chunks."""
    recording, end_ns = Recording(new), 0
    try:
        with opened(place, salvage=True) as storage:
            for each in storage.connections:
                if each.topic not in recording.counts:
                    recording.add_topic(
                        each.topic, each.msgtype, _latched(each.ext), _definition(each)
                    )
            for connection, time_ns, data in storage.messages(storage.connections):
                recording.write(connection.topic, data, time_ns)
                end_ns = max(end_ns, time_ns)
    except (OSError, KhrError):
        raise
    except Exception as error:
        text = one_line(str(error)) or type(error).__name__
        raise KhrError(
            f'{bag}: cannot be recovered ({text}); accepted: a bag that a recorder was writing'
        ) from error
    count = sum(recording.counts.values())
    if not count:
        raise KhrError(f'{bag}: no whole message in it; accepted: a bag with some')
    recording.close()
    return count, end_ns, storage.damaged


def _definition(connection: Connection) -> Definition:
    """Return the type of a connection, with the text that the bag itself holds, if any."""
    text = connection.msgdef
    return Definition(ENCODINGS[text.format], text.data, connection.digest)


def _latched(details: object) -> bool:
    assert isinstance(details, ConnectionExtRosbag2)
    return any(
        qos.durability == QosDurability.TRANSIENT_LOCAL for qos in details.offered_qos_profiles
    )
