"""Remains of dead processes in the shared memory of the middleware."""

from __future__ import annotations

import fcntl
import os
import re
from contextlib import suppress
from pathlib import Path

MEMORY = Path('/dev/shm')
_SEGMENT = re.compile(r'fastrtps_[0-9a-f]{16}')
_PORT = re.compile(r'fastrtps_port(\d+)')


def remove_dead_segments(ports: range) -> int:
    """Remove segments of dead processes, and ports of a domain without processes.

    Fast DDS holds a lock (flock) for each segment in use, which the kernel releases at the
    death of its process. Only segments of this user are considered.

    Args:
        ports: the numbers of a domain that the caller has claimed.

    Returns:
        How many were removed.
    """
    removed = 0
    for path in sorted(MEMORY.glob('fastrtps_*')):
        with suppress(OSError):
            port = _PORT.fullmatch(path.name)
            mine = path.stat().st_uid == os.getuid()
            whose = int(port[1]) in ports if port else bool(_SEGMENT.fullmatch(path.name))
            if mine and whose and _is_dead(path, needs_lock=not port):
                removed += 1
                for part in (path, *_locks(path), MEMORY / f'sem.{path.name}_mutex'):
                    part.unlink(missing_ok=True)
    return removed


def _locks(path: Path) -> tuple[Path, Path]:
    return path.with_name(f'{path.name}_el'), path.with_name(f'{path.name}_sl')


def _is_dead(path: Path, needs_lock: bool) -> bool:
    """Return whether no process holds a lock; a new segment may still be without one."""
    found = [lock for lock in _locks(path) if lock.exists()]
    for lock in found:
        with lock.open('rb') as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return False
    return bool(found) or not needs_lock
