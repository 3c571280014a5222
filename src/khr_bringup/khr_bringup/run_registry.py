"""A ROS domain of the run's own, and the register by which other commands find it again."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path

from khr_bringup.errors import BringupError

DOMAINS = range(1, 100)  # above 101 the middleware's ports meet the system's ephemeral ones


@dataclass(frozen=True)
class RunEntry:
    """A run that is going on."""

    domain: int
    pid: int
    scenario: str
    folder: str
    network: bool = False

    def environment(self) -> dict[str, str]:
        """Return what a process must have in its environment to take part in the run."""
        return {
            'ROS_DOMAIN_ID': str(self.domain),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET' if self.network else 'LOCALHOST',
            'FASTRTPS_DEFAULT_PROFILES_FILE': str(files('khr_bringup') / 'fastdds.xml'),
        }


def register() -> Path:
    """Return the folder in which this user's runs are registered."""
    base = os.environ.get('XDG_RUNTIME_DIR') or tempfile.gettempdir()
    folder = Path(base) / f'khr-{os.getuid()}'
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


def running() -> list[RunEntry]:
    """List the runs of this user that are going on, the newest last; forget dead ones."""
    entries = []
    for path in sorted(register().glob('*.json'), key=lambda path: path.stat().st_mtime):
        with suppress(ValueError, TypeError, OSError):
            entry = RunEntry(**json.loads(path.read_text()))
            if _alive(entry.pid):
                entries.append(entry)
                continue
        path.unlink(missing_ok=True)
    return entries


@contextmanager
def registered(
    scenario: str, folder: Path, domain: int | None = None, network: bool = False
) -> Iterator[RunEntry]:
    """Take a free domain (or the one asked for) for the time of a run.

    Raises:
        BringupError: if the domain asked for is not accepted or taken, or none is free.
    """
    if domain is not None and domain not in DOMAINS:
        raise BringupError(f'--domain: {domain} is not accepted; accepted: 1 to {DOMAINS[-1]}')
    running()
    for number in DOMAINS if domain is None else [domain]:
        entry = RunEntry(number, os.getpid(), scenario, str(folder), network)
        path = register() / f'{number}.json'
        try:
            with path.open('x') as file:
                json.dump(asdict(entry), file)
        except FileExistsError:
            continue
        try:
            yield entry
        finally:
            path.unlink(missing_ok=True)
        return
    raise BringupError(
        'no free ROS domain'
        if domain is None
        else f'--domain: {domain} is taken by another run; accepted: a free one'
    )


def choose(domain: int | None = None) -> RunEntry:
    """Return the run that a command means: the one of ``domain``, or the only one.

    Among several, ``ROS_DOMAIN_ID`` names one as for every ROS tool.

    Raises:
        BringupError: if there is none, or more than one and no domain was named.
    """
    entries = [entry for entry in running() if domain in (None, entry.domain)]
    if not entries:
        which = f'in domain {domain}' if domain is not None else ''
        raise BringupError(
            f'no run is going on {which}; start one with "khr run SCENARIO"'.replace(
                '  ', ' '
            ).replace(' ;', ';')
        )
    if len(entries) > 1:
        meant = os.environ.get('ROS_DOMAIN_ID')
        entries = [entry for entry in entries if str(entry.domain) == meant] or entries
    if len(entries) > 1:
        listed = ', '.join(f'{entry.domain} ({entry.scenario})' for entry in entries)
        raise BringupError(
            f'{len(entries)} runs are going on; name one with --domain or ROS_DOMAIN_ID: {listed}'
        )
    return entries[0]


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
