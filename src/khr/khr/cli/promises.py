"""What a run promises, as far as ``khr doctor`` can test it in place."""

from __future__ import annotations

import os
import re
import select
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from khr_bringup.graph.run_registry import register
from khr_common import RunError

Finding = tuple[bool, str, str]
GONE = 5.0  # s of wall time within which the child of a killed process ends
_LOOPBACK = '0100007F'  # 127.0.0.1 as /proc/net/udp writes it
_CHILD = 'from khr_common.lifeline import end_with_parent as e; e(); print(flush=True); input()'
_PARENT = f"""
import os, subprocess, sys
from khr_common.lifeline import PARENT
own = {{**os.environ, PARENT: str(os.getpid())}}
subprocess.Popen([sys.executable, '-c', {_CHILD!r}], env=own)
input()
"""


def open_sockets() -> list[str]:
    """Return the UDP sockets of this process that other machines may reach, as the kernel has them.

    Addresses are in hexadecimal, as in ``/proc/net/udp`` and ``/proc/net/udp6``.
    """
    own = set()
    for path in Path('/proc/self/fd').iterdir():
        with suppress(OSError):
            found = re.fullmatch(r'socket:\[(\d+)\]', os.readlink(path))
            own |= {found[1]} if found else set()
    lines = [
        line.split()
        for table in ('udp', 'udp6')
        for line in Path(f'/proc/net/{table}').read_text().splitlines()[1:]
    ]
    return [
        line[1] for line in lines if line[9] in own and not line[1].startswith(f'{_LOOPBACK}:')
    ]


def children_end() -> Finding:
    """Check that a child ends when the process that started it is killed."""
    with subprocess.Popen(
        [sys.executable, '-c', _PARENT], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as parent:
        assert parent.stdout is not None
        parent.stdout.readline()  # the child is there
        parent.kill()
        ended = bool(select.select([parent.stdout], [], [], GONE)[0])
    return (
        ended,
        'a child ends with its killed parent',
        'this kernel does not honour PR_SET_PDEATHSIG: end runs with Ctrl-C alone',
    )


def register_is_private() -> Finding:
    """Check that the register of runs is this user's own."""
    try:
        return True, f'register of runs {register()}', ''
    except RunError as error:
        return False, str(error), 'set XDG_RUNTIME_DIR to a folder of your own'
