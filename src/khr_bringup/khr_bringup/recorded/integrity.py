"""Integrity of a bag: its checksums, and its metadata."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from rosbags.rosbag2.storage_mcap import read_bytes, read_sized, read_string

from khr_analysis.checksums import damage
from khr_common.errors import KhrError

ACCEPTED = 'accepted: a bag as its recorder left it'
_INFORMATION = 'rosbag2_bagfile_information'
_METADATA_INDEX, _SUMMARY_OFFSET = 0x0D, 0x0E  # kinds of records
_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)


def check_bag(place: Path) -> None:
    """Check a bag without decoding its messages.

    Args:
        place: a rosbag2 folder, or an MCAP file.

    Raises:
        KhrError: if a file is not as it was written, or the metadata beside it say other
            than those in it.
    """
    files = sorted(place.glob('*.mcap')) if place.is_dir() else [place]
    try:
        if len(files) != 1:
            raise KhrError(f'{place}: {len(files)} MCAP files; accepted: a bag with one')
        (file,) = files
        if found := damage(file):
            raise KhrError(f'{file}: {found}; {ACCEPTED}')
        if place.is_dir():
            _check_metadata(place / 'metadata.yaml', file)
    except OSError as error:
        raise KhrError(f'{place}: {error.strerror or error}; {ACCEPTED}') from error


def _check_metadata(beside: Path, file: Path) -> None:
    own: Any = yaml.load(_metadata_in(file), _LOADER)
    try:
        found = yaml.load(beside.read_bytes(), _LOADER)[_INFORMATION]
        differing = [key for key in own if found.get(key) != own[key]]
    except FileNotFoundError as error:
        raise KhrError(f'{beside}: not there; {ACCEPTED}') from error
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


def _metadata_in(file: Path) -> str:
    """Return the metadata that a recorder leaves in the file itself, as YAML."""
    with file.open('rb') as stream:
        stream.seek(-28, 2)
        stream.seek(int.from_bytes(stream.read(8), 'little'))
        while (kind := stream.read(1)[0]) != _METADATA_INDEX:
            if kind == _SUMMARY_OFFSET:
                raise KhrError(f'{file}: no metadata in it; {ACCEPTED}')
            read_sized(stream)
        stream.seek(8, 1)
        stream.seek(int.from_bytes(stream.read(8), 'little') + 9)
        for read in (read_string, lambda of: of.read(4), read_string):
            read(stream)
        return str(read_bytes(stream), 'utf-8')
