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
from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream
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
    damaged: int = 0  # chunks that are left out

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
        salvage: read the files one by one if the metadata are damaged or do not fit, and leave
            out damaged chunks.

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
                elif all(_is_readable(file, salvage) for file in place.glob('*.mcap')):
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
            reader, damaged = _reader(stack, file, folder, salvage)
            storage.readers.append(reader)
            storage.damaged += damaged
            if damaged:
                storage.notes.append(f'{file.name}: damaged chunks that are left out: {damaged}.')
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


def _reader(stack: ExitStack, file: Path, folder: Path, salvage: bool) -> tuple[Reader, int]:
    """Open one file; decompress or mend it into the folder first, if necessary.

    Returns:
        Its reader, and how many damaged chunks are left out.
    """
    file = decompressed(file, folder)
    try:
        reader = stack.enter_context(Reader(file))
        if file.suffix != '.mcap' or _is_readable(file, salvage):
            return reader, 0
        raise McapError(f'{file.name}: no index of its messages, or damaged')
    except Exception as error:  # rosbags takes the profile of ROS and an index for granted
        if file.suffix != '.mcap' or not (salvage or _is_whole(file)):
            raise
        mended = folder / f'mended-{file.name}'
        damaged = mend(file, mended)
        reader = stack.enter_context(Reader(mended))
        if not reader.message_count:
            raise McapError(f'no whole message in {file.name}') from error
        return reader, damaged


def mend(damaged: Path, whole: Path) -> int:
    """Write the messages of the whole chunks of an MCAP file to another one.

    The file of a killed recorder has no end, and its last chunk may be cut. Channels without a
    schema are left out.

    Returns:
        How many chunks are not as they were written, by their checksum.

    Raises:
        OSError: if a file cannot be read or written.
    """
    schemas, channels, lost = {}, {}, 0
    with whole.open('wb') as stream, damaged.open('rb') as file:
        writer: Any = Writer(stream, compression=CompressionType.NONE)
        writer.start('ros2')
        for record in _records(file):
            if record is None:
                lost += 1
            elif isinstance(record, Schema) and record.id not in schemas:
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
    return lost


def _records(file: BinaryIO) -> Iterator[McapRecord | None]:
    """Yield the records of an MCAP file, in the place of a damaged chunk None.

    A file without an index of its chunks is read up to the first place that is no record.
    """
    limit = os.fstat(file.fileno()).st_size
    summary = None
    # the reader's own, by the kind of damage; an OSError of a file that is shorter than its end
    with suppress(McapError, ValueError, struct.error, OSError):
        summary = make_reader(file).get_summary()
    if summary is not None and summary.chunk_indexes:
        yield from (*summary.schemas.values(), *summary.channels.values())
        for place in sorted(each.chunk_start_offset for each in summary.chunk_indexes):
            file.seek(place)
            reader = StreamReader(file, skip_magic=True, emit_chunks=True, record_size_limit=limit)
            yield from _split(reader.records)
        return
    file.seek(0)
    whole = StreamReader(file, emit_chunks=True, record_size_limit=limit).records
    with suppress(McapError, ValueError, struct.error):
        for record in whole:
            yield from _split(iter([record])) if isinstance(record, Chunk) else [record]


def _split(records: Iterator[McapRecord]) -> Sequence[McapRecord | None]:
    """Return the records of the chunk that comes next; None alone if it is damaged."""
    try:
        chunk = next(records)
        return breakup_chunk(chunk, True) if isinstance(chunk, Chunk) else [None]
    except OSError:
        raise
    except Exception:  # a damaged chunk fails in many ways, by its compression
        return [None]


def is_intact(file: Path) -> bool:
    """Return whether an MCAP file has an index, and is as it was written by its checksums."""
    limit = file.stat().st_size
    try:
        with file.open('rb') as stream:
            for record in StreamReader(
                stream, emit_chunks=True, validate_crcs=True, record_size_limit=limit
            ).records:
                if isinstance(record, Chunk):
                    get_chunk_data_stream(record, validate_crc=True)
        return is_indexed(file)
    except OSError:
        raise
    except Exception:  # a damaged file fails in many ways inside the reader
        return False


def _is_readable(file: Path, salvage: bool) -> bool:
    """Return whether an MCAP file can be read as it is; salvaging looks at its checksums."""
    return is_intact(file) if salvage else is_indexed(file)


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
