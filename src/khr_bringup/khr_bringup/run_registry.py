"""A ROS domain of the run's own, and the register by which other commands find it again."""

from __future__ import annotations

import json
import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from stat import S_ISDIR
from uuid import uuid4

from khr_bringup.errors import BringupError
from khr_bringup.shared_memory import sweep
from khr_common import RunError
from khr_common.files import write_text

# Above 101 the middleware's ports meet the system's ephemeral ones; small numbers are what others
# choose by hand, so a run takes a large one.
DOMAINS = range(99, 0, -1)
PORT_BASE, PORTS_PER_DOMAIN = 7400, 250  # DDSI-RTPS 2.3, 9.6.1.1
# For rclpy.init in a process that has no log folder: rclpy would make one in the user's home.
WITHOUT_LOG = ['--ros-args', '--disable-external-lib-logs']
FIRST_PARTICIPANT, PARTICIPANTS = 10, 32  # offset of the first one's port; as in fastdds.xml


@dataclass(frozen=True)
class RunEntry:
    """A run that is going on.

    Attributes:
        domain: ROS domain.
        pid: of the command.
        scenario: its name.
        folder: of its results.
        network: whether other machines may take part.
        run: identity of the run: messages of another one are refused.
        lock: file descriptor that holds the domain; whoever inherits it holds it too.
    """

    domain: int
    pid: int
    scenario: str
    folder: str
    network: bool = False
    run: str = ''
    lock: int = field(default=-1, compare=False)

    def environment(self) -> dict[str, str]:
        """Return what a process must have in its environment to take part in the run."""
        profile = 'fastdds_network.xml' if self.network else 'fastdds.xml'
        common = {
            'ROS_DOMAIN_ID': str(self.domain),
            'FASTRTPS_DEFAULT_PROFILES_FILE': str(files('khr_bringup') / profile),
            'KHR_RUN': self.run,
        }
        if self.network:
            return {**common, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
        # The profile alone decides: for any other range rmw_fastrtps adds sockets of its own.
        return {
            **common,
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SYSTEM_DEFAULT',
            'ROS_STATIC_PEERS': '',
            'ROS_DISCOVERY_SERVER': '',
            'RMW_IMPLEMENTATION': 'rmw_fastrtps_cpp',
        }

    @property
    def to_join(self) -> str:
        """Return what to export so that ROS tools of this machine see the run."""
        reach = 'SUBNET' if self.network else 'LOCALHOST'
        return f'ROS_DOMAIN_ID={self.domain} ROS_AUTOMATIC_DISCOVERY_RANGE={reach}'


def ports_of(domain: int) -> range:
    """Return the UDP ports of a domain."""
    start = PORT_BASE + PORTS_PER_DOMAIN * domain
    return range(start, start + PORTS_PER_DOMAIN)


def register() -> Path:
    """Return the folder in which this user's runs are registered.

    Raises:
        RunError: if it cannot be made, or is not this user's own.
    """
    base = os.environ.get('XDG_RUNTIME_DIR') or tempfile.gettempdir()
    folder = Path(base) / f'khr-runs-{os.getuid()}'
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
    except OSError as error:
        raise RunError(
            f'{folder}: {error.strerror}; accepted: a folder that can be written, '
            'under XDG_RUNTIME_DIR or TMPDIR'
        ) from error
    if not S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or found.st_mode & 0o022:
        raise RunError(
            f'{folder}: not a folder that only this user can write; accepted: such a one, or '
            'another XDG_RUNTIME_DIR'
        )
    return folder


def running() -> list[RunEntry]:
    """List the runs of this user that are going on, the newest last; forget dead ones."""
    entries = []
    for path in sorted(register().glob('*.json'), key=_time_of):
        with suppress(ValueError, TypeError, OSError):
            entry = RunEntry(**json.loads(path.read_text(encoding='utf-8')))
            if _alive(entry.pid) and _held(entry.domain):
                entries.append(entry)
                continue
        _forget(path)
    return entries


def check_domain(domain: int | None) -> None:
    """Refuse a domain that no run can have.

    Raises:
        BringupError: if it is not None and out of range.
    """
    if domain is not None and domain not in DOMAINS:
        raise BringupError(f'--domain: {domain} is not accepted; accepted: 1 to {DOMAINS[0]}')


@contextmanager
def registered(
    scenario: str, folder: Path, domain: int | None = None, network: bool = False
) -> Iterator[RunEntry]:
    """Take a free domain (or the one asked for) for the time of a run.

    A domain is held by all that inherit ``lock``, so it is free again when the last of them has
    ended, and among all users of the machine.

    Raises:
        BringupError: if the domain asked for is not accepted or taken, or none is free.
        RunError: if the run cannot be registered.
    """
    check_domain(domain)
    lock, number = _claimed(domain)
    with lock:
        entry = RunEntry(
            number, os.getpid(), scenario, str(folder), network, uuid4().hex, lock.fileno()
        )
        path = register() / f'{number}.json'
        public = {key: value for key, value in asdict(entry).items() if key != 'lock'}
        sweep(ports_of(number))
        try:
            write_text(path, json.dumps(public))
            yield entry
        finally:
            path.unlink(missing_ok=True)
            sweep(ports_of(number))


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
        listed = ', '.join(
            f'{entry.domain} ({entry.scenario}, {entry.folder})' for entry in entries
        )
        raise BringupError(
            f'{len(entries)} runs are going on; name one with --domain or ROS_DOMAIN_ID: {listed}'
        )
    return entries[0]


def _claimed(domain: int | None) -> tuple[socket.socket, int]:
    for number in DOMAINS if domain is None else [domain]:
        lock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            lock.bind(_name(number))
        except OSError:
            lock.close()
            continue
        # Whoever asks for a domain by number may want to meet others there.
        if domain is None and _inhabited(number):
            lock.close()
            continue
        return lock, number
    raise BringupError(
        'no free ROS domain'
        if domain is None
        else f'--domain: {domain} is taken by another run; accepted: a free one'
    )


def _forget(path: Path) -> None:
    """Remove an entry, unless its domain is held: then it is a new run's."""
    domain = path.stem.removeprefix('.')
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as lock, suppress(OSError):
        lock.bind(_name(domain))
        path.unlink(missing_ok=True)


def _name(domain: int | str) -> str:
    """Return an address in the abstract namespace: one for all users, gone with its holders."""
    return f'\0khr-domain-{domain}'


def _held(domain: int) -> bool:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(_name(domain))
        except ConnectionRefusedError:
            return False
        return True


def _inhabited(domain: int) -> bool:
    """Return whether any program of this machine takes part in a domain."""
    first = ports_of(domain).start + FIRST_PARTICIPANT
    for port in range(first, first + 2 * PARTICIPANTS, 2):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.bind(('127.0.0.1', port))
            except OSError:
                return True
    return False


def _time_of(path: Path) -> float:
    try:
        return path.stat().st_mtime
    except OSError:  # its run has ended meanwhile
        return 0.0


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
