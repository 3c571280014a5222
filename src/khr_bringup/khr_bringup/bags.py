"""Reading the bag of a run, without ROS."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from khr_bringup.errors import BringupError

Messages = dict[str, list[Any]]


def read_messages(bag: Path, topics: Sequence[str]) -> Messages:
    """Return the messages of some topics in the order they were recorded.

    Args:
        bag: the bag, or the folder of the run that holds it.
        topics: names; one that is not in the bag has no messages.

    Raises:
        BringupError: if it is no bag or is damaged.
    """
    folder = bag / 'bag' if (bag / 'bag').is_dir() else bag
    store = get_typestore(Stores.ROS2_JAZZY)
    messages: Messages = {topic: [] for topic in topics}
    try:
        with Reader(folder) as reader:
            chosen = [each for each in reader.connections if each.topic in messages]
            for connection, _, data in reader.messages(chosen) if chosen else ():
                messages[connection.topic].append(
                    store.deserialize_cdr(data, connection.msgtype))
    except Exception as error:  # a damaged file fails in many ways inside the reader
        text = ' '.join(str(error).split()) or type(error).__name__
        raise BringupError(f'{bag}: not a readable bag ({text}); accepted: a rosbag2 folder or '
                           'the folder of a run') from error
    return messages


def seconds(message: Any) -> float:
    """Return the stamp of a message in s."""
    return float(message.header.stamp.sec) + float(message.header.stamp.nanosec) / 1e9
