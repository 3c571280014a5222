"""Integrity of a bag: its checksums, and its metadata."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zlib import crc32

import yaml
from mcap.records import DataEnd, Footer, Header, McapRecord
from mcap.records import Metadata as MetadataRecord
from mcap.stream_reader import CRCValidationError, StreamReader

from khr_analysis.recording import INFORMATION, METADATA_KEY
from khr_bringup.recorded.storage import METADATA, files_of
from khr_common.errors import KhrError

ACCEPTED = 'accepted: a bag as its recorder left it'
UNCHECKED = 'no checksums ({}): only its numbers are compared'
LIBRARY = 'mcap-python/'  # by which khr writes its bags
_AFTER_SUMMARY = 12  # bytes: the checksum of the summary, and the magic of MCAP
Records = dict[type[McapRecord], McapRecord]


def check_bag(place: Path) -> str:
    """Check a bag without decoding its messages.

    Args:
        place: a rosbag2 folder, or one of its files.

    Returns:
        A note on what could not be checked (another tool wrote the bag, or ``metadata.yaml`` is
        missing); empty if all was checked.

    Raises:
        KhrError: if a file is not as it was written, or the metadata beside it say other
            than those in it.
    """
    files = files_of(place)
    if [each.suffix for each in files] != ['.mcap']:
        return UNCHECKED.format('split, compressed or SQLite')
    (file,) = files
    try:
        records = _read(file)
        if not records:
            return UNCHECKED.format('written by another tool')
        if place.is_dir():
            if not (place / METADATA).exists():
                return f'{METADATA} is missing: only the checksums and numbers are compared'
            _check_metadata(place / METADATA, file, records)
    except OSError as error:
        raise KhrError(f'{place}: {error.strerror or error}; {ACCEPTED}') from error
    return ''


def _check_metadata(beside: Path, file: Path, records: Records) -> None:
    inside = records.get(MetadataRecord)
    if not isinstance(inside, MetadataRecord) or METADATA_KEY not in inside.metadata:
        raise KhrError(f'{file}: no metadata in it; {ACCEPTED}')
    own: Any = yaml.load(inside.metadata[METADATA_KEY], yaml.CSafeLoader)
    try:
        found = yaml.load(beside.read_bytes(), yaml.CSafeLoader)[INFORMATION]
        differing = [key for key in own if found.get(key) != own[key]]
    except (
        yaml.YAMLError,
        UnicodeError,
        KeyError,
        TypeError,
        ValueError,
        AttributeError,
    ) as error:
        raise KhrError(f'{beside}: not readable; {ACCEPTED}') from error
    if differing:
        raise KhrError(
            f'{beside}: {", ".join(differing)}: not as in {file.name} beside it; {ACCEPTED}'
        )


def _read(file: Path) -> Records:
    """Return the last record of each kind, of a file that is as it was written.

    Returns:
        The records; none if another tool wrote the file, without a checksum of all messages.

    Raises:
        KhrError: if it is cut or changed by its checksums, or lacks one that its writer gives.
    """
    size = file.stat().st_size
    records: Records = {}
    with file.open('rb') as stream:
        reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=size)
        try:
            records.update((type(record), record) for record in reader.records)
            end, footer = records[DataEnd], records[Footer]
            assert isinstance(end, DataEnd) and isinstance(footer, Footer)
        except CRCValidationError as error:
            raise KhrError(f'{file}: messages changed, by their checksum; {ACCEPTED}') from error
        except OSError:
            raise
        except Exception as error:  # a damaged file fails in many ways inside the reader
            raise KhrError(f'{file}: cut or damaged; {ACCEPTED}') from error
        # rosbag2, and the mcap library by itself, give none of all messages
        missing = not end.data_section_crc and _is_of_khr(records)
        if missing or (end.data_section_crc and not footer.summary_crc):
            raise KhrError(f'{file}: a checksum is missing; {ACCEPTED}')
        if not footer.summary_crc:
            return {}
        stream.seek(footer.summary_start)  # the reader checks all but the summary
        summary = stream.read(max(0, size - footer.summary_start - _AFTER_SUMMARY))
    if crc32(summary) != footer.summary_crc:
        raise KhrError(f'{file}: summary changed, by its checksum; {ACCEPTED}')
    return records if end.data_section_crc else {}


def _is_of_khr(records: Records) -> bool:
    """Return whether the recorder of khr wrote a file.

    It alone writes the metadata of rosbag2 by the mcap library of Python.
    """
    header, inside = records.get(Header), records.get(MetadataRecord)
    return (
        isinstance(header, Header)
        and header.library.startswith(LIBRARY)
        and isinstance(inside, MetadataRecord)
        and METADATA_KEY in inside.metadata
    )
