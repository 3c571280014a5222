"""Reading the bag of a run, without ROS."""

from __future__ import annotations

from array import array
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from rosbags.interfaces import Connection
from rosbags.typesys import Stores, get_typestore

from khr_analysis.referee import ROBOTS
from khr_bringup.recorded.storage import (
    ACCEPTED,
    decompressed,
    files_of,
    is_recording,
    mend,
    opened,
    refuse_ros1,
)
from khr_common import KhrError, cdr
from khr_common.cdr import Floats
from khr_common.interfaces import FINISHED, TRUE_POSE, Topic

# By topic: (stamp in ns, numbers) of periodic topics, whole messages of the others.
Messages = dict[Topic, Any]  # a list of messages, or Samples of a periodic topic
NumbersOf = Callable[[Topic], cdr.Reader]


class AmbiguousError(KhrError):
    """A recording of several robots, of which one must be named."""


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
    """Return the existing recording of a run.

    Args:
        bag: the recording, one of its files, or the folder of a run.
    """
    place = bag_of(bag)
    if not place.exists():
        raise KhrError(f'{bag}: not there; {ACCEPTED}')
    refuse_ros1(place)
    if not is_recording(place):
        raise KhrError(
            f'{bag}: no bag in it: an --offline or --no-record run leaves none; {ACCEPTED}'
        )
    return place


def read_messages(
    bag: Path, topics: Sequence[Topic], numbers_of: NumbersOf = cdr.numbers_of, namespace: str = ''
) -> Messages:
    """Return the messages of some topics in the order they were recorded.

    Args:
        bag: the bag, or the folder of the run that holds it.
        topics: a topic that is not in the bag, or there is of another type, has no messages.
        numbers_of: returns the decoder of a periodic topic.
        namespace: of the robot; by default the only one that has these topics.

    Raises:
        KhrError: if it is no bag or is damaged, or several namespaces have these topics.
    """
    place, messages = existing_bag(bag), _empty(topics)
    try:
        _collect(place, messages, numbers_of, namespace)
    except AmbiguousError as error:
        raise AmbiguousError(f'{bag}: {error}') from error
    except Exception as error:  # a damaged file fails in many ways inside the reader
        text = ' '.join(str(error).split()) or type(error).__name__
        raise KhrError(
            f'{bag}: not a readable bag ({text}); accepted: a whole one; "khr recover" keeps '
            'its whole messages'
        ) from error
    return messages


def robots_in(bag: Path) -> list[str]:
    """Return the namespaces of the robots of a recording, of a bout red first.

    Empty if it is of one robot at the root.
    """
    try:
        with opened(existing_bag(bag)) as storage:
            names = [each.topic for each in storage.connections]
    except Exception:  # a damaged file fails in many ways; its reader raises the error
        return []
    suffix = f'/{TRUE_POSE.name}'
    found = {name.removesuffix(suffix).strip('/') for name in names if name.endswith(suffix)}
    order = [*(each for each in ROBOTS if each in found), *sorted(found - {*ROBOTS})]
    return [] if '' in found else order


def read_what_is_left(
    bag: Path, topics: Sequence[Topic], namespace: str = ''
) -> tuple[Messages, str]:
    """Like :func:`read_messages`, but return the whole messages of a damaged bag.

    Returns:
        The messages, and the damage of the bag; empty if it is whole.
    """
    try:
        return read_messages(bag, topics, namespace=namespace), ''
    except KhrError as damage:
        messages = _empty(topics)
        place = bag_of(bag)
        if isinstance(damage, AmbiguousError) or not place.exists():
            raise
        with TemporaryDirectory() as folder:
            for file in files_of(place):
                with suppress(Exception):
                    whole = decompressed(file, Path(folder))
                    if whole.suffix == '.mcap':
                        mended = Path(folder) / 'mended.mcap'
                        mend(whole, mended)
                        whole = mended
                    _collect(whole, messages, namespace=namespace)
        if not any(messages.values()):
            raise
        return messages, str(damage)


def final_state(states: Sequence[Any]) -> dict[str, str]:
    """Return the simulator's report at the end of a run; empty if the bag has no end."""
    finished = [message for message in states if message.message == FINISHED]
    return {pair.key: pair.value for pair in finished[-1].values} if finished else {}


def _empty(topics: Sequence[Topic]) -> Messages:
    return {topic: Samples() if topic.flow == 'period' else [] for topic in topics}


def _collect(
    bag: Path, messages: Messages, numbers_of: NumbersOf = cdr.numbers_of, namespace: str = ''
) -> None:
    whole = get_typestore(Stores.ROS2_JAZZY).deserialize_cdr
    with opened(bag) as storage:
        typed = [each for each in storage.connections if _topic_of(each, messages) is not None]
        robot = namespace_of([each.topic for each in typed], messages, namespace)
        chosen, read = [], {}
        for connection in typed:
            topic = _topic_of(connection, messages)
            if topic is None or connection.topic != full_name(topic, robot):
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
        for connection, _, data in storage.messages(chosen):
            counts[connection.topic] += 1
            keep, decode = read[connection.topic]
            message: Any = decode(data)
            keep(message)
        stated: Counter[str] = Counter()
        for connection in chosen:
            stated[connection.topic] += connection.msgcount
        for name, number in stated.items():
            if counts[name] != number:
                raise ValueError(f'{name}: {counts[name]} messages, {number} by its metadata')


def _topic_of(connection: Connection, topics: Iterable[Topic]) -> Topic | None:
    """Return the topic that a connection carries in any namespace, if its type is the same."""
    return next(
        (
            topic
            for topic in topics
            if topic.kind == connection.msgtype
            and connection.topic.endswith('/' + topic.name.lstrip('/'))
        ),
        None,
    )


def namespace_of(names: Iterable[str], topics: Iterable[Topic], namespace: str = '') -> str:
    """Return the namespace of the robot whose topics a recording holds.

    Raises:
        AmbiguousError: if several namespaces have the same topic, and none is asked for.
    """
    if namespace:
        return namespace.strip('/')
    relative = [topic.name for topic in topics if not topic.name.startswith('/')]
    found = [
        name.removesuffix('/' + topic).strip('/')
        for topic in relative
        for name in names
        if name.endswith('/' + topic)
    ]
    by_number = Counter(found).most_common()
    # a few root topics of a bout do not make a robot at the root
    at_root = found.count('') * 2 > by_number[0][1] if found else True
    spaces = [each for each in by_number if each[0] or at_root]
    if len(spaces) > 1 and not at_root and spaces[0][1] < 2 * spaces[1][1]:
        raise AmbiguousError(
            'namespace: needed, there are several robots; accepted: '
            + ', '.join(sorted(f'/{each}' for each, _ in spaces))
        )
    return '' if at_root else spaces[0][0]


def full_name(topic: Topic, namespace: str) -> str:
    """Return the name of a topic in a namespace."""
    if topic.name.startswith('/'):
        return topic.name
    return f'/{namespace}/{topic.name}' if namespace else f'/{topic.name}'


def _sample(read: cdr.Reader, data: bytes) -> tuple[int, Floats]:
    return cdr.clock(data), read(data)
