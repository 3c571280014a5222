"""Read and write the messages of every control period directly as bytes.

rclpy turns a message into a tree of Python objects, which takes longer than the nodes' own work.
The few numbers that they need are at known offsets: ROS 2 sends CDR (OMG DDS-XTypes
1.3, 7.4): four bytes that name the encoding, then the fields in order, each aligned to its size.

All functions take little-endian CDR, as :func:`khr_common.nodes.messages.little_endian` returns it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from struct import Struct
from struct import error as StructError
from typing import NamedTuple

from khr_common.errors import MalformedError
from khr_common.interfaces import CLOCK, IMU, JOINT_STATE, TRUE_POSE, TRUE_SOLES, WRENCH, Topic

BLANK = -1.2345678987654321e300  # stands where numbers of a template are to be filled in
Floats = tuple[float, ...]
Reader = Callable[[bytes], Floats]
# Raised when the bytes are not a message of the expected type.
UNREADABLE = (StructError, ValueError, KeyError, IndexError, OverflowError, RuntimeError)

_TIME = Struct('<iI')
_COUNT = Struct('<I')
_THREE, _SIX, _SEVEN = Struct('<3d'), Struct('<6d'), Struct('<7d')
_START = 4  # of the fields, behind the encoding
_STAMPED = _START + _TIME.size  # the end of the stamp in a header
_FRAME = _STAMPED + _COUNT.size  # where its frame begins
MOST_FORMS = 50  # of JointStates that are remembered
_DOUBLE = 8
_BLANK = Struct('<d').pack(BLANK)
_RATE = 13 * _DOUBLE  # in an Imu, behind orientation and its covariance
_TWIST = 43 * _DOUBLE  # in an Odometry, behind the pose and its covariance


class MessageTemplate:
    """A serialized message of which only timestamps and the numbers at :data:`BLANK` change.

    Args:
        data: a Clock, or a message with a header.
        stamps: byte offsets of its timestamps.

    Attributes:
        count: number of blanks.
    """

    def __init__(self, data: bytes, stamps: Sequence[int] = (4,)) -> None:
        self._data, self._stamps = bytearray(data), tuple(stamps)
        blanks = [
            place
            for place in range(_START, len(data) - _DOUBLE + 1, _DOUBLE)
            if data[place : place + _DOUBLE] == _BLANK
        ]
        self.count = len(blanks)
        bounds = [
            number
            for number, place in enumerate(blanks)
            if not number or place - blanks[number - 1] > _DOUBLE
        ] + [len(blanks)]
        self._runs = [
            (blanks[start], slice(start, end), Struct(f'<{end - start}d').pack_into)
            for start, end in pairwise(bounds)
        ]

    def filled(self, stamp_ns: int, numbers: Sequence[float] = ()) -> bytes:
        """Return the message with this stamp and, in its blanks from first to last, the numbers.

        Raises:
            ValueError: if there are not as many numbers as blanks.
        """
        if len(numbers) != self.count:
            raise ValueError(f'numbers: {len(numbers)} are not accepted; accepted: {self.count}')
        time = divmod(stamp_ns, 1_000_000_000)
        for place in self._stamps:
            _TIME.pack_into(self._data, place, *time)
        for place, part, pack_into in self._runs:
            pack_into(self._data, place, *numbers[part])
        return bytes(self._data)


def transforms(frames: Sequence[tuple[str, str]]) -> tuple[bytes, list[int]]:
    """Return a tf2_msgs/TFMessage with blanks for all transforms, and where its stamps are.

    Args:
        frames: parent and child of each transform, of which x, y, z and quaternion x y z w are
            blank.
    """
    data = bytearray(b'\0\1\0\0') + _COUNT.pack(len(frames))
    stamps = []
    for names in frames:
        data += bytes(_padded(len(data), 4) - len(data))
        stamps.append(len(data))
        data += bytes(_TIME.size)
        for name in names:
            text = name.encode() + b'\0'
            data += bytes(_padded(len(data), 4) - len(data)) + _COUNT.pack(len(text)) + text
        data += bytes(_aligned(len(data)) - len(data)) + 7 * _BLANK
    return bytes(data), stamps


def clock(data: bytes) -> int:
    """Return the time of a Clock, or of the header of any stamped message, in ns."""
    seconds, rest = _TIME.unpack_from(data, _START)
    return int(seconds) * 1_000_000_000 + int(rest)


def frame(data: bytes) -> str:
    """Return the frame in the header of any stamped message."""
    return data[_FRAME : _after_header(data) - 1].decode()


def force(data: bytes) -> Floats:
    """Return the force of a WrenchStamped, N, (3,)."""
    return _THREE.unpack_from(data, _aligned(_after_header(data)))


def angular_velocity(data: bytes) -> Floats:
    """Return the angular velocity of an Imu, rad/s, (3,)."""
    return _THREE.unpack_from(data, _aligned(_after_header(data)) + _RATE)


def pose(data: bytes) -> Floats:
    """Return the pose of an Odometry: x, y, z in m, quaternion x y z w."""
    return _SEVEN.unpack_from(data, _aligned(_after_text(data, _after_header(data))))


def poses(data: bytes) -> Floats:
    """Return the poses of a PoseArray, one behind the other, each as :func:`pose` does."""
    place, count = _counted(data, _after_header(data))
    return Struct(f'<{7 * count}d').unpack_from(data, _aligned(place) if count else place)


def joint_positions(data: bytes) -> tuple[tuple[str, ...], Floats]:
    """Return the joint names of a JointState and their positions, rad.

    The messages of a publisher differ only in timestamp and numbers: the names are read once.
    """
    form = _forms.get(len(data))
    if form is None or data[_STAMPED : form.place] != form.text:
        form = _forms[len(data)] = _form_of(data)
        if len(_forms) > MOST_FORMS:
            del _forms[next(iter(_forms))]
    return form.names, form.unpack_from(data, form.place)


class _Form(NamedTuple):
    """The bytes of a JointState between its timestamp and its positions at ``place``."""

    text: bytes
    place: int
    names: tuple[str, ...]
    unpack_from: Callable[[bytes, int], Floats]


def _form_of(data: bytes) -> _Form:
    place, count = _counted(data, _after_header(data))
    names = []
    for _ in range(count):
        start, end = _padded(place, 4) + 4, _after_text(data, place)
        names.append(data[start : end - 1].decode())
        place = end
    place, count = _counted(data, place)
    place = _aligned(place) if count else place
    return _Form(data[_STAMPED:place], place, tuple(names), Struct(f'<{count}d').unpack_from)


_forms: dict[int, _Form] = {}  # by length of the message


def pose_and_twist(data: bytes) -> Floats:
    """Return the pose of an Odometry as :func:`pose` does, then its twist, m/s and rad/s, (13,)."""
    place = _aligned(_after_text(data, _after_header(data)))
    return _SEVEN.unpack_from(data, place) + _SIX.unpack_from(data, place + _TWIST)


def joint_motion(data: bytes) -> Floats:
    """Return the positions, velocities and efforts of a JointState, in a row."""
    place, count = _counted(data, _after_header(data))
    for _ in range(count):
        place = _after_text(data, place)
    numbers: Floats = ()
    for _ in range(3):
        place, count = _counted(data, place)
        place = _aligned(place) if count else place
        numbers += Struct(f'<{count}d').unpack_from(data, place)
        place += count * _DOUBLE
    return numbers


def numbers_of(topic: Topic) -> Reader:
    """Return the function that reads the numbers of a topic of flow ``period``.

    For a JointState it returns the positions in the order of the topic's names.
    """
    if topic.kind == JOINT_STATE:
        return partial(_ordered, topic.names)
    return _READERS[topic.kind][0]


def length_of(topic: Topic) -> int:
    """Return how many numbers flow on a topic of flow ``period``."""
    return _READERS[topic.kind][1] if topic.kind in _READERS else len(topic.names)


def _ordered(names: tuple[str, ...], data: bytes) -> Floats:
    found, positions = joint_positions(data)
    if found == names:
        return positions
    by_name = dict(zip(found, positions, strict=True))
    missing = [name for name in names if name not in by_name]
    if missing:
        raise MalformedError(f'no joint {missing[0]}')
    return tuple([by_name[name] for name in names])


# How the numbers of a kind without names are read, and how many there are.
_READERS: dict[str, tuple[Reader, int]] = {
    CLOCK.kind: (lambda _: (), 0),
    IMU: (angular_velocity, 3),
    WRENCH: (force, 3),
    TRUE_POSE.kind: (pose, 7),
    TRUE_SOLES.kind: (poses, 14),
}


def _after_header(data: bytes) -> int:
    return _FRAME + int(_COUNT.unpack_from(data, _STAMPED)[0])


def _after_text(data: bytes, place: int) -> int:
    start, length = _counted(data, place)
    return start + length


def _counted(data: bytes, place: int) -> tuple[int, int]:
    """Return the offset behind a count, and the count."""
    place = _padded(place, 4)
    return place + 4, int(_COUNT.unpack_from(data, place)[0])


def _aligned(place: int) -> int:
    return _padded(place, _DOUBLE)


def _padded(place: int, size: int) -> int:
    return place + (_START - place) % size
