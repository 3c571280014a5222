"""Keep the whole messages of a damaged MCAP file."""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

from mcap.exceptions import McapError
from mcap.records import Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer


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
