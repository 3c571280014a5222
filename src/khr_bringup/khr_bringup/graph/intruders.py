"""Participants of other users in the domain of a run, from the kernel's table of sockets."""

from __future__ import annotations

import os
import pwd
import time
from pathlib import Path

from khr_bringup.graph.run_registry import CLAIM, FIRST_PARTICIPANT, ports_of

SOCKETS = Path('/proc/net/udp')
PERIOD = 0.2  # s of wall time between looks


class Intruders:
    """Watch for DDS participants of other users; those present before the run do not count.

    A participant listens on two adjacent ports of its domain, so a program with only one of them
    does not count. The superuser is ignored.
    """

    def __init__(self, domain: int) -> None:
        self._first = ports_of(domain).start + FIRST_PARTICIPANT
        self._ports = range(self._first, ports_of(domain).start + CLAIM)
        self._domain, self._before, self._looked = domain, set[tuple[int, int]](), 0.0
        self._before = self._found()

    def found(self) -> str | None:
        """Return an error if a participant of another user has joined, else None."""
        now = time.monotonic()
        if now - self._looked < PERIOD:
            return None
        self._looked = now
        for port, user in sorted(self._found() - self._before):
            return (
                f'the user {_name(user)} takes part in domain {self._domain} '
                f'(UDP ports {port} and {port + 1})'
            )
        return None

    def _found(self) -> set[tuple[int, int]]:
        """Return the first port and the user of each participant of others."""
        users = {
            port: user
            for port, user in _sockets()
            if port in self._ports and user not in (0, os.getuid())
        }
        return {
            (port, user)
            for port, user in users.items()
            if (port - self._first) % 2 == 0 and users.get(port + 1) == user
        }


def _sockets() -> list[tuple[int, int]]:
    """Return port and user of each UDP socket of this machine; empty without a table."""
    try:
        lines = SOCKETS.read_text(encoding='ascii').splitlines()[1:]
    except OSError:
        return []
    fields = [line.split() for line in lines]
    return [(int(each[1].rpartition(':')[2], 16), int(each[7])) for each in fields]


def _name(user: int) -> str:
    try:
        return pwd.getpwuid(user).pw_name
    except KeyError:
        return str(user)
