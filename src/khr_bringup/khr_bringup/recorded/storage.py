"""Open a recording of ROS 2 in any of its forms.

A recording is a rosbag2 folder, with its ``metadata.yaml`` or without, or one of its files. The
files are MCAP or SQLite, several if the recording was split, and may be compressed as a whole
(``.zstd``) or message by message.
"""

from __future__ import annotations

import os
import shutil
import struct
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader
from rosbags.rosbag2.reader import DirectoryReader

from khr_common.errors import KhrError, one_line

SUFFIXES = ('.mcap', '.db3', '.mcap.zstd', '.db3.zstd')
ROS1 = '.bag'  # of a file of ROS 1, which is no recording of ROS 2
METADATA = 'metadata.yaml'
ACCEPTED = (
    'accepted: a rosbag2 folder, an MCAP or SQLite file of one, or the folder of a run that '
    'recorded one'
)
_COMPRESSED = b'\x28\xb5\x2f\xfd'  # the first bytes of zstd; CDR begins with 0


@dataclass
class Storage:
    """The messages of an open recording."""

    readers: list[Any]  # of its files, in their order
    notes: list[str] = field(default_factory=list)  # on its form, a sentence each

    @property
    def connections(self) -> list[Connection]:
        """Return the publishers' connections of all files; each has topic, type and count."""
        return [connection for reader in self.readers for connection in reader.connections]

    def messages(self, chosen: Collection[Connection]) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield connection, time of recording in ns and bytes of each message, file by file."""
        for reader in self.readers:
            own = [connection for connection in reader.connections if connection in chosen]
            for connection, time_ns, data in reader.messages(own) if own else ():
                whole = bytes(data)
                if whole[:4] == _COMPRESSED:
                    whole = zstandard.ZstdDecompressor().decompressobj().decompress(whole)
                yield connection, time_ns, whole


def files_of(place: Path) -> list[Path]:
    """Return the files of a recording in their order; a file is its own."""
    if place.is_file():
        return [place]
    found = [each for each in place.iterdir() if each.name.endswith(SUFFIXES)]
    return sorted(found, key=_part_number)


def is_recording(place: Path) -> bool:
    """Return whether a path is a recording: a file of one, or a folder with such files.

    A file of ROS 1 counts too, so that it is refused as one.
    """
    if place.is_file():
        return place.name.endswith((*SUFFIXES, ROS1))
    return place.is_dir() and ((place / METADATA).is_file() or bool(files_of(place)))


def refuse_ros1(place: Path) -> None:
    """Refuse a recording of ROS 1, a file or a folder with such files alone.

    Raises:
        KhrError: if it is one; it says how to convert it.
    """
    inside = sorted(place.glob(f'*{ROS1}')) if not is_recording(place) else []
    for file in [place] if place.is_file() else inside:
        if file.suffix == ROS1 and file.is_file():
            raise KhrError(
                f'{file}: a recording of ROS 1; accepted: one of ROS 2, as by rosbags-convert --src '
                f'{file} --dst {file.stem}'
            )


@contextmanager
def opened(place: Path, salvage: bool = False) -> Iterator[Storage]:
    """Open a recording.

    Args:
        place: its folder, or one of its files.
        salvage: read the files one by one if the metadata are damaged or do not fit.

    Raises:
        KhrError: if it is no recording.
        Exception: if a file is damaged.
    """
    trouble = f'{METADATA} is missing'
    with ExitStack() as stack:
        if place.is_dir() and (place / METADATA).is_file():
            trouble = ''
            try:
                reader = stack.enter_context(Reader(place))
            except Exception as error:  # metadata fail in many ways inside the reader
                if not salvage or not files_of(place):
                    raise
                trouble = f'{METADATA} cannot be used ({one_line(str(error))})'
            else:
                assert isinstance(reader.storage, DirectoryReader)
                inside = Storage(list(reader.storage.storages))
                if trouble := _misfit(reader, inside):
                    if not salvage:
                        raise ValueError(trouble)
                elif all(is_indexed(file) for file in place.glob('*.mcap')):
                    yield inside
                    return
        files = files_of(place) if is_recording(place) else []
        if not files:
            raise KhrError(f'{place}: not a recording; {ACCEPTED}')
        folder = Path(stack.enter_context(TemporaryDirectory()))
        storage = _read_files(stack, files, folder, salvage)
        if place.is_dir() and trouble:
            storage.notes.append(
                f'{trouble}: the files are read without it ("ros2 bag reindex" or "khr recover" '
                'write one).'
            )
        yield storage


def _misfit(stated: Reader, inside: Storage) -> str:
    """Return how the numbers of messages by the metadata differ from those in the files."""
    counts = [Counter[str](), Counter[str]()]
    for count, connections in zip(counts, (stated.connections, inside.connections), strict=True):
        for each in connections:
            count[each.topic] += each.msgcount
    by_metadata, found = counts
    return next(
        (
            f'{name}: {found[name]} messages, {by_metadata[name]} by {METADATA}'
            for name in sorted(found | by_metadata)
            if found[name] != by_metadata[name]
        ),
        '',
    )


def _read_files(stack: ExitStack, files: list[Path], folder: Path, salvage: bool) -> Storage:
    """Open files one by one; salvaging leaves out unreadable files."""
    storage = Storage([])
    for file in files:
        try:
            storage.readers.append(_reader(stack, file, folder, salvage))
        except Exception as error:
            last = file is files[-1] and not storage.readers
            if last or not salvage:
                raise
            text = one_line(str(error)) or type(error).__name__
            storage.notes.append(f'{file.name} is left out: it cannot be read ({text}).')
    return storage


def decompressed(file: Path, folder: Path) -> Path:
    """Return a file, or its decompressed copy in the folder."""
    if file.suffix != '.zstd':
        return file
    whole = folder / file.stem
    with file.open('rb') as stream, whole.open('wb') as out:
        shutil.copyfileobj(zstandard.ZstdDecompressor().stream_reader(stream), out)
    return whole


def _reader(stack: ExitStack, file: Path, folder: Path, salvage: bool) -> Reader:
    """Open one file; decompress or mend it into the folder first, if necessary."""
    file = decompressed(file, folder)
    try:
        reader = stack.enter_context(Reader(file))
        if file.suffix != '.mcap' or is_indexed(file):
            return reader
        raise McapError(f'{file.name}: no index of its messages')
    except Exception as error:  # rosbags takes the profile of ROS and an index for granted
        if file.suffix != '.mcap' or not (salvage or _is_whole(file)):
            raise
        mended = folder / f'mended-{file.name}'
        mend(file, mended)
        reader = stack.enter_context(Reader(mended))
        if not reader.message_count:
            raise McapError(f'no whole message in {file.name}') from error
        return reader


def mend(damaged: Path, whole: Path) -> None:
    """Write the messages before the damage of an MCAP file to a whole MCAP file.

    The file of a killed recorder has no end, and its last chunk may be cut. Channels without a
    schema are left out.

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
            elif isinstance(record, Channel) and record.schema_id in schemas:
                if record.id in channels:
                    continue
                channels[record.id] = writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    schemas[record.schema_id],
                    record.metadata,
                )
            elif isinstance(record, Message) and record.channel_id in channels:
                writer.add_message(
                    channels[record.channel_id], record.log_time, record.data, record.publish_time
                )
        writer.finish()


def _records_before_damage(file: BinaryIO) -> Iterator[McapRecord]:
    limit = os.fstat(file.fileno()).st_size
    with suppress(McapError, ValueError, struct.error):  # the reader's own, by the kind of damage
        yield from StreamReader(file, validate_crcs=True, record_size_limit=limit).records


def is_indexed(file: Path) -> bool:
    """Return whether every chunk of an MCAP file has an index of its messages.

    The reader of rosbags finds nothing in a chunk without one.
    """
    with file.open('rb') as stream:
        summary = make_reader(stream).get_summary()
    return summary is None or all(each.message_index_offsets for each in summary.chunk_indexes)


def _is_whole(file: Path) -> bool:
    """Return whether an MCAP file has its end."""
    with file.open('rb') as stream:
        stream.seek(max(0, file.stat().st_size - len(MCAP0_MAGIC)))
        return stream.read() == MCAP0_MAGIC


def _part_number(file: Path) -> tuple[int, str]:
    """Return the number of a part of a split recording, which is behind its name."""
    # the name itself may have dots
    number = Path(file.name.removesuffix('.zstd')).stem.rpartition('_')[2]
    return int(number) if number.isdecimal() else -1, file.name
