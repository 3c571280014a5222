"""One number over time from any topic of any recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from khr_analysis.quantities import QUANTITIES, Quantity, Rows, stamp_of
from khr_analysis.sampling import Samples, choose_stamps, even_samples
from khr_bringup.recorded.bags import AmbiguousError, existing_bag
from khr_bringup.recorded.storage import Storage, opened
from khr_common.errors import KhrError, named, one_line, quoted
from khr_common.interfaces import GYRO, IMU

Array = NDArray[np.float64]
Stamps = NDArray[np.int64]
SHOWN = 5  # topics that an error lists


@dataclass(frozen=True, eq=False)
class Channel:
    """The samples of one number of a topic, as recorded."""

    # topic, kind: name and type of the topic
    topic: str
    kind: str
    axis: str  # of the number
    quantity: Quantity  # to which it belongs
    stamps: Stamps  # timestamps of the messages, ns, (N,); 0 without one
    logs: Stamps  # times of recording, ns, (N,)
    values: Array  # in the shown unit, (N,)
    frame: str  # of the messages
    notes: tuple[str, ...]  # on the recording, a sentence each

    @property
    def label(self) -> str:
        """Return quantity, axis and topic."""
        frame = f' in {self.frame}' if self.frame else ''
        return f'{self.quantity.name} {named(self.axis)}{frame} on {named(self.topic)}'

    def even(self) -> Samples:
        """Return the longest stretch without a gap, sampled evenly.

        Raises:
            KhrError: if no stretch is long enough.
        """
        stamps, chosen = choose_stamps(self.stamps, self.logs)
        try:
            found = even_samples(stamps, self.values)
        except KhrError as error:
            raise KhrError(f'{self.topic}: {" ".join((*chosen, ""))}{error}') from error
        return Samples(
            found.start,
            found.period,
            found.values,
            found.highest,
            (*self.notes, *chosen, *found.notes),
        )


@dataclass(frozen=True)
class TopicCount:
    """A topic of a recording, or a field of one, its type and its number of messages."""

    name: str  # of the topic; of a field /topic.field
    kind: str
    messages: int


def topics_in(path: Path) -> tuple[list[TopicCount], list[str]]:
    """Return the topics of a recording, and notes on its form.

    Raises:
        KhrError: if it is no recording, or cannot be read.
    """
    with _opened(path) as storage:
        return _topics(storage), list(storage.notes)


def read_channel(path: Path, topic: str = '', axis: str = '', namespace: str = '') -> Channel:
    """Read one number of a topic.

    Args:
        path: the recording, one of its files, or the folder of a run.
        topic: its name; by default the only topic of type ``sensor_msgs/msg/Imu``. ``/topic.field``
            is a field of a message of another type, if the recording defines this type.
        axis: ``x``, ``y`` or ``z``; of a JointState the name of a joint.
        namespace: in which the topic is.

    Raises:
        KhrError: if there is no such recording, topic or axis, or it cannot be read.
    """
    with _opened(path) as storage:
        chosen = _choose(_topics(storage) + _fields(storage), topic, namespace)
        quantity = QUANTITIES[chosen.kind]
        stamps, logs, rows, frame = _read(storage, chosen, quantity)
        notes = list(storage.notes)
    axes = sorted({name for row in rows for name, _ in row}, key=_order(rows))
    wanted = axis or quantity.default or (axes[0] if axes else '')
    if not axis and wanted != quantity.default and len(axes) > 1:
        notes.append(
            f'{wanted} is the first of {len(axes)} in the topic; --axis NAME takes another.'
        )
    if wanted not in axes:
        raise KhrError(
            f'axis: {quoted(wanted)} is not in {chosen.name}; accepted: '
            f'{", ".join(map(named, axes)) or "a topic with messages"}'
        )
    table = {
        name: np.array([dict(row).get(name, np.nan) for row in rows], dtype=np.float64)
        for name in axes
    }
    moving = [name for name in axes if _moves(table[name])]
    if wanted not in moving:
        raise KhrError(
            f'axis: {named(wanted)} of {chosen.name} {_still(table[wanted])}; accepted: '
            f'{", ".join(f"--axis {named(name)}" for name in moving) or "a topic that changes"}'
        )
    with np.errstate(over='ignore'):  # infinite values are left out and counted
        values = table[wanted] * quantity.factor
    return Channel(
        chosen.name, chosen.kind, wanted, quantity, stamps, logs, values, frame, tuple(notes)
    )


def _moves(values: Array) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size) and bool(np.min(known) < np.max(known))


def _still(values: Array) -> str:
    """Return why a number has no spectrum."""
    known = np.count_nonzero(np.isfinite(values))
    if known > 1:
        return 'is constant and has no spectrum'
    return f'has {known} finite number{"" if known == 1 else "s"} in {len(values)} messages'


def _order(rows: list[Rows]) -> Callable[[str], int]:
    places = {name: place for row in rows[:1] for place, (name, _) in enumerate(row)}
    return lambda name: places.get(name, len(places))


@contextmanager
def _opened(path: Path) -> Iterator[Storage]:
    place = existing_bag(path)
    try:
        with opened(place, salvage=True) as storage:
            yield storage
    except KhrError:
        raise
    except Exception as error:  # a damaged file fails in many ways inside the reader
        text = one_line(str(error)) or type(error).__name__
        raise KhrError(
            f'{path}: not a readable recording ({text}); accepted: one with whole messages; "khr '
            'recover" keeps its whole messages'
        ) from error


def _topics(storage: Storage) -> list[TopicCount]:
    return _counted((each.topic, each.msgtype, each.msgcount) for each in storage.connections)


def _fields(storage: Storage) -> list[TopicCount]:
    """Return the fields that have a quantity, of the messages of other types."""
    return _counted(
        (f'{each.topic}.{field}', kind, each.msgcount)
        for each in storage.connections
        for field, (_, kind) in _definition(each).get(each.msgtype, ((), ()))[1]
        if kind in QUANTITIES
    )


def _counted(found: Iterable[tuple[str, str, int]]) -> list[TopicCount]:
    """Add the numbers of messages of all connections, which have a name, a type and a number."""
    counts: Counter[tuple[str, str]] = Counter()
    for name, kind, number in found:
        counts[name, kind] += number
    return [TopicCount(name, kind, number) for (name, kind), number in sorted(counts.items())]


def _definition(connection: Connection) -> Typesdict:
    """Return the types that a connection's own definition holds, without those of ROS 2 itself."""
    known = get_typestore(Stores.ROS2_JAZZY).types
    if connection.msgtype in known or connection.msgdef.format != MessageDefinitionFormat.MSG:
        return {}
    try:
        found = get_types_from_msg(connection.msgdef.data, connection.msgtype)
    except Exception:  # a damaged definition fails in many ways inside the parser
        return {}
    return {name: types for name, types in found.items() if name not in known}


def _choose(topics: list[TopicCount], name: str, namespace: str) -> TopicCount:
    """Return the topic to read.

    Raises:
        KhrError: if there is none, or its type is not accepted.
        AmbiguousError: if there are several.
    """
    inside = f'/{namespace.strip("/")}/' if namespace.strip('/') else '/'
    # the writers of rosbag2 accept names without the first slash
    found = [
        each for each in topics if each.messages and f'/{each.name.lstrip("/")}'.startswith(inside)
    ]
    known = [each for each in found if each.kind in QUANTITIES]
    listed = ', '.join(f'--topic {each.name} ({each.kind})' for each in known)
    accepted = f'accepted: {listed or "a recording with a topic of " + ", ".join(QUANTITIES)}'
    if not listed:
        held = found or [each for each in topics if each.messages]
        others = ', '.join(f'{each.name} ({each.kind})' for each in held[:SHOWN])
        more = f' and {len(held) - SHOWN} more' if len(held) > SHOWN else ''
        where = 'this one has' if found else f'none in {inside}: it has'
        accepted += f'; {where} messages of {others}{more}' if held else '; it is empty'
    if name:
        wanted = (name, inside + name.strip('/'))
        having = [each for each in found if each.name in wanted or f'/{each.name}' in wanted]
        if not having:
            raise KhrError(f'topic: {quoted(name)} has no messages; {accepted}')
        if having[0].kind not in QUANTITIES:
            raise KhrError(f'topic: {name} is of type {having[0].kind}; {accepted}')
        return having[0]
    gyros = [each for each in known if each.kind == IMU]
    if not gyros:
        raise KhrError(f'topic: no topic of type {IMU}; {accepted}')
    raw = [each for each in gyros if each.name.endswith('/' + GYRO.name)]
    if len(gyros) > 1 and len(raw) != 1:
        several = ', '.join(f'--topic {each.name}' for each in gyros)
        raise AmbiguousError(f'topic: several of type {IMU}; accepted: {several}')
    return (raw or gyros)[0]


def _read(
    storage: Storage, chosen: TopicCount, quantity: Quantity
) -> tuple[Stamps, Stamps, list[Rows], str]:
    """Return timestamps, times of recording, numbers and frame of the messages."""
    topic, _, field = chosen.name.partition('.')
    connections = [
        each
        for each in storage.connections
        if each.topic == topic and (field or each.msgtype == chosen.kind)
    ]
    store = get_typestore(Stores.ROS2_JAZZY)
    for connection in connections:
        store.register(_definition(connection))
    stamps, logs, rows, frame = [], [], [], ''
    for connection, time_ns, data in storage.messages(connections):
        whole: Any = store.deserialize_cdr(data, connection.msgtype)
        message = getattr(whole, field) if field else whole
        stamps.append(stamp_of(message) or stamp_of(whole) or 0)
        frame = message.header.frame_id if hasattr(message, 'header') else ''
        logs.append(time_ns)
        rows.append(quantity.read(message))
    return np.array(stamps, np.int64), np.array(logs, np.int64), rows, frame
