"""Checksums of an MCAP file, which the library that writes it leaves out (https://mcap.dev/spec).

That of each chunk is for all who read the file; those of the data section, from the first byte on,
and of the summary behind it leave no byte that is not covered.
"""

from __future__ import annotations

from os import SEEK_END
from pathlib import Path
from struct import Struct
from typing import Any, BinaryIO
from zlib import crc32

MAGIC = b'\x89MCAP0\r\n'
_CHUNK_CRC = 9 + 24  # where it stands, from the beginning of a chunk's record
_DATA_END = Struct('<BQI')  # kind, length, checksum
_FOOTER = Struct('<BQQQI8s')  # kind, length, start of summary and of offsets, checksum, magic
_CRC = Struct('<I')
_BLOCK = 1 << 20  # bytes that are read at a time


class Checksums:
    """Add the checksums of a file that is being written.

    Args:
        storage: the writer, of rosbags; its ``close_chunk`` writes the checksum as well from now
            on, and passes all to the system.
    """

    def __init__(self, storage: Any) -> None:
        self._storage, self._close_chunk = storage, storage.close_chunk
        self._covered = self._crc = 0  # bytes of the data section so far, and their checksum
        storage.close_chunk = self._end_chunk

    def seal(self) -> None:
        """Add those of the whole file, which has been closed.

        Raises:
            OSError: if the disk takes no more.
        """
        with self._storage.path.open('r+b') as file:
            end = file.seek(-_FOOTER.size, SEEK_END)
            start = _FOOTER.unpack(file.read())[2]
            data_end = start - _DATA_END.size
            _put(file, start - _CRC.size, _crc(file, self._covered, data_end, self._crc))
            place = end + _FOOTER.size - len(MAGIC) - _CRC.size
            _put(file, place, _crc(file, start, place))

    def _end_chunk(self) -> None:
        storage = self._storage
        place, crc = storage.bio.tell() + _CHUNK_CRC, crc32(storage.chunk.bio.getbuffer())
        self._close_chunk()
        end = storage.bio.tell()
        _put(storage.bio, place, crc)
        storage.bio.seek(end)
        storage.bio.flush()
        with storage.path.open('rb') as file:
            self._crc, self._covered = _crc(file, self._covered, end, self._crc), end


def damage(path: Path) -> str:
    """Return the damage of an MCAP file by its checksums; empty if it is undamaged.

    Raises:
        OSError: if it cannot be read.
    """
    with path.open('rb') as file:
        size = file.seek(0, SEEK_END)
        if size < len(MAGIC) + _DATA_END.size + _FOOTER.size:
            return 'it is cut'
        file.seek(size - _FOOTER.size)
        kind, length, start, _, summary, magic = _FOOTER.unpack(file.read())
        data_end = start - _DATA_END.size
        if (kind, length, magic) != (0x02, 20, MAGIC) or not 0 < data_end < size - _FOOTER.size:
            return 'it has no end: it is cut or damaged there'
        file.seek(data_end)
        kind, length, data = _DATA_END.unpack(file.read(_DATA_END.size))
        if (kind, length) != (0x0F, 4):
            return 'its summary is not where its end says'
        if not (data and summary):
            return 'it has no checksums: it was written by another tool, or an older version'
        if data != _crc(file, 0, data_end):
            return 'its messages are not as they were written, by their checksum'
        if summary != _crc(file, start, size - len(MAGIC) - _CRC.size):
            return 'its summary is not as it was written, by its checksum'
    return ''


def _crc(file: BinaryIO, start: int, end: int, crc: int = 0) -> int:
    """Return the checksum of a part of a file behind that of what stands before it."""
    file.seek(start)
    while start < end and (block := file.read(min(_BLOCK, end - start))):
        crc, start = crc32(block, crc), start + len(block)
    return crc


def _put(file: BinaryIO, place: int, crc: int) -> None:
    file.seek(place)
    file.write(_CRC.pack(crc))
