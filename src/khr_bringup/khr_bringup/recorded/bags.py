"""Reading the bag of a run, without ROS."""

from __future__ import annotations

import struct
from array import array
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from khr_common import KhrError, cdr
from khr_common.cdr import Floats
from khr_common.interfaces import FINISHED, Topic

# By topic: (stamp in ns, numbers) of periodic topics, whole messages of the others.
Messages = dict[Topic, Any]  # a list of messages, or Samples of a periodic topic
NumbersOf = Callable[[Topic], cdr.Reader]

# MCAP (https://mcap.dev/spec): magic, then records of one byte of kind and eight of length.
_MAGIC = b'\x89MCAP0\r\n'
_RECORD = struct.Struct('<BQ')
_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 0x03, 0x04, 0x05, 0x06
_CHUNK_HEAD = struct.Struct('<QQQIIQ')  # of an uncompressed chunk, with an empty compression name
_END = _RECORD.pack(0x0F, 4) + bytes(4) + _RECORD.pack(0x02, 20) + bytes(20) + _MAGIC


class Samples:
    """Stamps, ns, and numbers of a topic in order, in little more room than they take."""

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


def there(bag: Path) -> Path:
    """Return the bag as :func:`bag_of` does.

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
    place, messages = there(bag), _empty(topics)
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
                mended.write_bytes(mend(file.read_bytes()))
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
    """Return whether a topic has this full name in some namespace."""
    return f'/{name}'.endswith('/' + topic.name.lstrip('/'))


def _sample(read: cdr.Reader, data: bytes) -> tuple[int, Floats]:
    return cdr.clock(data), read(data)


def mend(content: bytes) -> bytes:
    """Return a whole MCAP file made of the records before the damage in another.

    A recorder that is killed leaves a file without an end, and its last chunk may be cut: chunks
    without compression are opened, so that only the record at the cut is lost.
    """
    kept = [
        record
        for kind, record in _records(content)
        if kind in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK)
    ]
    header = _RECORD.pack(0x01, 12) + struct.pack('<I', 4) + b'ros2' + struct.pack('<I', 0)
    return b''.join((_MAGIC, header, *kept, _END))


def _records(content: bytes) -> Iterator[tuple[int, bytes]]:
    """Yield kind and bytes of the whole records of an MCAP file, up to its end or damage."""
    place = len(_MAGIC)
    while place + _RECORD.size <= len(content):
        kind, size = _RECORD.unpack_from(content, place)
        start = place + _RECORD.size
        plain = kind == _CHUNK and content[start + 28 : start + 32] == bytes(4)
        end = start + (_CHUNK_HEAD.size if plain else size)
        if end > len(content):
            return
        if not plain:
            yield kind, content[place:end]
        place = end
