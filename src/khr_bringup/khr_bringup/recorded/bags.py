"""Reading the bag of a run, without ROS."""

from __future__ import annotations

import os
import struct
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from khr_common import KhrError, cdr
from khr_common.cdr import Floats
from khr_common.interfaces import FINISHED, Topic

# By topic: (stamp in ns, numbers) of periodic topics, whole messages of the others.
Messages = dict[Topic, Any]  # a list of messages, or Samples of a periodic topic
NumbersOf = Callable[[Topic], cdr.Reader]


class Samples:
    """Stamps in ns and numbers of a topic, in growing arrays."""

    def __init__(self) -> None:
        self.stamps, self.numbers = array('q'), array('d')
        self.width = 0

    def append(self, sample: tuple[int, Floats]) -> None:
        """Add a sample; all of a topic have as many numbers.

        Raises:
            ValueError: if it has another number of them.
        """
        stamp_ns, numbers = sample
        if self.stamps and len(numbers) != self.width:
            raise ValueError(f'{len(numbers)} numbers in one message, {self.width} in another')
        self.width = len(numbers)
        self.stamps.append(stamp_ns)
        self.numbers.extend(numbers)

    def __len__(self) -> int:
        return len(self.stamps)

    def __iter__(self) -> Iterator[tuple[int, Floats]]:
        for index, stamp_ns in enumerate(self.stamps):
            yield stamp_ns, tuple(self.numbers[index * self.width : (index + 1) * self.width])


def bag_of(path: Path) -> Path:
    """Return the bag in a run's folder; or the bag that is given."""
    return path / 'bag' if (path / 'bag').exists() else path


def existing_bag(bag: Path) -> Path:
    """Return the existing bag of a run.

    Raises:
        KhrError: if there is no bag.
    """
    place = bag_of(bag)
    if not place.exists():
        raise KhrError(
            f'{bag}: not there; accepted: a rosbag2 folder, or the folder of a run that recorded one'
        )
    if place.is_dir() and not (place / 'metadata.yaml').exists() and not any(place.glob('*.mcap')):
        raise KhrError(
            f'{bag}: no bag in it: an --offline or --no-record run leaves none; accepted: a '
            'rosbag2 folder, or the folder of a run that recorded one'
        )
    return place


def read_messages(
    bag: Path, topics: Sequence[Topic], numbers_of: NumbersOf = cdr.numbers_of
) -> Messages:
    """Return the messages of some topics in the order they were recorded.

    Args:
        bag: the bag, or the folder of the run that holds it.
        topics: in any namespace; a topic that is not in the bag has no messages.
        numbers_of: returns the decoder of a periodic topic.

    Raises:
        KhrError: if it is no bag or is damaged.
    """
    place, messages = existing_bag(bag), _empty(topics)
    try:
        _collect(place, messages, numbers_of)
    except Exception as error:  # a damaged file fails in many ways inside the reader
        text = ' '.join(str(error).split()) or type(error).__name__
        raise KhrError(
            f'{bag}: not a readable bag ({text}); accepted: a rosbag2 folder or '
            'the folder of a run'
        ) from error
    return messages


def read_what_is_left(bag: Path, topics: Sequence[Topic]) -> tuple[Messages, str]:
    """Return the messages as :func:`read_messages`, of a damaged bag those before the damage.

    Returns:
        The messages, and the damage of the bag; empty if it is whole.

    Raises:
        KhrError: if nothing can be read.
    """
    try:
        return read_messages(bag, topics), ''
    except KhrError as damage:
        messages = _empty(topics)
        place = bag_of(bag)
        files = sorted(place.glob('*.mcap')) if place.is_dir() else [place]
        with TemporaryDirectory() as folder, suppress(Exception):
            mended = Path(folder) / 'mended.mcap'
            for file in files:
                mend(file, mended)
                _collect(mended, messages)
        if not any(messages.values()):
            raise
        return messages, str(damage)


def final_state(states: Sequence[Any]) -> dict[str, str]:
    """Return the simulator's report at the end of a run; empty if the bag has no end.

    Args:
        states: the messages on ``simulator/state``.
    """
    finished = [message for message in states if message.message == FINISHED]
    return {pair.key: pair.value for pair in finished[-1].values} if finished else {}


def _empty(topics: Sequence[Topic]) -> Messages:
    return {topic: Samples() if topic.flow == 'period' else [] for topic in topics}


def _collect(bag: Path, messages: Messages, numbers_of: NumbersOf = cdr.numbers_of) -> None:
    whole = get_typestore(Stores.ROS2_JAZZY).deserialize_cdr
    with Reader(bag) as reader:
        chosen, read = [], {}
        for connection in reader.connections:
            topic = next((each for each in messages if _is(each, connection.topic)), None)
            if topic is None:
                continue
            chosen.append(connection)
            numbers = numbers_of(topic) if topic.flow == 'period' else None
            read[connection.topic] = (
                messages[topic].append,
                partial(_sample, numbers)
                if numbers
                else partial(whole, typename=connection.msgtype),
            )
        counts: Counter[str] = Counter()
        for connection, _, data in reader.messages(chosen) if chosen else ():
            counts[connection.topic] += 1
            keep, decode = read[connection.topic]
            message: Any = decode(bytes(data))
            keep(message)
        for connection in chosen:
            if counts[connection.topic] != connection.msgcount:
                raise ValueError(
                    f'{connection.topic}: {counts[connection.topic]} messages, '
                    f'{connection.msgcount} by its metadata'
                )


def _is(topic: Topic, name: str) -> bool:
    """Return whether a full name is this topic in any namespace."""
    return f'/{name}'.endswith('/' + topic.name.lstrip('/'))


def _sample(read: cdr.Reader, data: bytes) -> tuple[int, Floats]:
    return cdr.clock(data), read(data)


def mend(damaged: Path, whole: Path) -> None:
    """Write the messages before the damage of an MCAP file to a whole MCAP file.

    The file of a killed recorder has no end, and its last chunk may be cut.

    Raises:
        OSError: if a file cannot be read or written.
    """
    schemas, channels = {}, {}
    with whole.open('wb') as stream, damaged.open('rb') as file:
        writer: Any = Writer(stream, compression=CompressionType.NONE)
        writer.start('ros2')
        for record in _records_before_damage(file):
            if isinstance(record, Schema) and record.id not in schemas:
                schemas[record.id] = writer.register_schema(
                    record.name, record.encoding, record.data
                )
            elif isinstance(record, Channel) and record.id not in channels:
                channels[record.id] = writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    schemas[record.schema_id],
                    record.metadata,
                )
            elif isinstance(record, Message):
                writer.add_message(
                    channels[record.channel_id], record.log_time, record.data, record.publish_time
                )
        writer.finish()


def _records_before_damage(file: BinaryIO) -> Iterator[McapRecord]:
    limit = os.fstat(file.fileno()).st_size
    with suppress(McapError, ValueError, struct.error):  # the reader's own, by the kind of damage
        yield from StreamReader(file, validate_crcs=True, record_size_limit=limit).records
