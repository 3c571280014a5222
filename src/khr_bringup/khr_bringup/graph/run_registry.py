"""The ROS domain of a run, and the register by which other commands find the run."""

from __future__ import annotations

import fcntl
import json
import os
import re
import socket
import struct
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from stat import S_ISDIR
from typing import Any
from uuid import uuid4

from khr_bringup.graph.shared_memory import remove_dead_segments
from khr_common import RunError
from khr_common.errors import KhrError
from khr_common.files import write_text

# Above 101 the ports of the middleware overlap the ephemeral ports of the system; users pick
# small numbers by hand, so a run takes a large one.
DOMAINS = range(99, 0, -1)
PORT_BASE, PORTS_PER_DOMAIN = 7400, 250  # DDSI-RTPS 2.3, 9.6.1.1
# For rclpy.init in a process that has no log folder: rclpy would make one in the user's home.
WITHOUT_LOG = ['--ros-args', '--disable-external-lib-logs']
FIRST_PARTICIPANT, PARTICIPANTS = 10, 32  # offset of the first one's port; as in fastdds.xml
CLAIM = PORTS_PER_DOMAIN - 1  # offset of a port that no participant takes, which holds the domain
PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'  # environment variable of the middleware
_CONSUMER = re.compile('<consumer>.*?</consumer>', re.DOTALL)  # of the middleware's log
_LARGEST_PID = 2**22  # of Linux
_FLOCK = struct.Struct('hhqqi')  # struct flock of fcntl(2): type, whence, start, length, process


@dataclass(frozen=True)
class RunEntry:
    """A run that is going on."""

    domain: int  # ROS domain
    pid: int  # of the command
    scenario: str
    folder: str  # of its results
    network: bool = False  # whether other machines may take part
    run: str = ''  # identity of the run: messages of another one are refused
    place: str = ''  # working folder of the command
    since: float = 0.0  # when it was started, s since 1970
    state: str = 'starting'  # as its progress reports it
    # file descriptors that hold the domain; whoever inherits them holds it too
    locks: tuple[int, ...] = field(default=(), compare=False)

    @property
    def title(self) -> str:
        """Return a description for people: scenario, domain and folder of its results."""
        return f'{self.scenario} (domain {self.domain}, {Path(self.place, self.folder)})'

    def next_run(self, scenario: str, folder: Path) -> RunEntry:
        """Return the entry of another run in the same domain."""
        return replace(
            self, scenario=scenario, folder=str(folder), run=uuid4().hex, since=time.time()
        )

    def environment(self) -> dict[str, str]:
        """Return the environment variables of a process of the run."""
        profile = 'fastdds_network.xml' if self.network else 'fastdds.xml'
        common = {
            'ROS_DOMAIN_ID': str(self.domain),
            PROFILE: str(files('khr_bringup') / profile),
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

    def quiet_environment(self) -> dict[str, str]:
        """Return the environment of a command, without the middleware's log on stderr.

        The middleware logs an error for each port that another starting run holds.
        """
        environment = self.environment()
        profile = Path(environment[PROFILE])
        own = register() / profile.name
        write_text(own, _CONSUMER.sub('', profile.read_text(encoding='utf-8')))
        return environment | {PROFILE: str(own)}

    @property
    def to_join(self) -> str:
        """Return the variables to export so that ROS tools of this machine join the run."""
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
    """List the active runs of this user, the newest last; remove entries of dead runs."""
    entries = []
    paths = [path for path in register().glob('*.json') if not path.name.startswith('.')]
    for path in sorted(paths, key=_time_of):  # a name with a dot is of a file being written
        with suppress(ValueError, TypeError, OSError, RecursionError):
            entry = _entry(json.loads(path.read_text(encoding='utf-8')))
            if Path(f'/proc/{entry.pid}').exists() and _is_locked(entry.domain):
                entries.append(entry)
                continue
        _forget(path)
    return entries


def _entry(values: Any) -> RunEntry:
    """Return a registered run; raise ValueError or TypeError if the values are not one."""
    entry, example = RunEntry(**values), RunEntry(1, 1, '', '')
    for name, value in vars(example).items():
        if type(getattr(entry, name)) is not type(value) and name != 'locks':
            raise TypeError(name)
    if entry.domain not in DOMAINS or not 0 < entry.pid <= _LARGEST_PID:
        raise ValueError('domain or process')
    return entry


def check_domain(domain: int | None) -> None:
    """Check that a number is a valid ROS domain."""
    if domain is not None and domain not in DOMAINS:
        raise KhrError.refused('--domain', domain, f'1 to {DOMAINS[0]}')


@contextmanager
def registered(
    scenario: str, folder: Path, domain: int | None = None, network: bool = False
) -> Iterator[RunEntry]:
    """Claim a free domain (or the given one) for the duration of a run.

    All processes that inherit ``locks`` hold the domain, so it is free again when the last one has
    ended. Among this user's runs a lock of a file in the register marks it as taken; between users
    a bound port does. If other users hold the ports of all domains, a domain that seems to be in
    use is taken; if somebody publishes there, the run ends.

    Raises:
        KhrError: if the domain asked for is not accepted or taken, or no domain is free.
        RunError: if the run cannot be registered.
    """
    check_domain(domain)
    with ExitStack() as held:
        number, locks = _claim_domain(domain, held)
        entry = RunEntry(
            number,
            os.getpid(),
            scenario,
            str(folder),
            network,
            run=uuid4().hex,
            place=str(Path.cwd()),
            since=time.time(),
            locks=locks,
        )
        remove_dead_segments(ports_of(number))
        try:
            write_entry(entry)
            yield entry
        finally:
            _path(number).unlink(missing_ok=True)
            remove_dead_segments(ports_of(number))


def write_entry(entry: RunEntry) -> None:
    """Write the entry of a run to the register."""
    public = {key: value for key, value in asdict(entry).items() if key != 'locks'}
    write_text(_path(entry.domain), json.dumps(public))


def _path(domain: int) -> Path:
    return register() / f'{domain}.json'


def choose(domain: int | None = None) -> RunEntry:
    """Return the run that a command means: the one of ``domain``, or the only one started here.

    ``ROS_DOMAIN_ID`` selects a run as for every ROS tool. A run that was started in another working
    folder must be named, since it may belong to other work.

    Raises:
        KhrError: if there is no such run, or several match.
    """
    entries = running()
    if domain is None:
        named = [each for each in entries if str(each.domain) == os.environ.get('ROS_DOMAIN_ID')]
        meant = named or [each for each in entries if each.place == str(Path.cwd())]
    else:
        meant = [each for each in entries if each.domain == domain]
    if len(meant) == 1:
        return meant[0]
    if entries and domain is None:
        where = f'{len(meant)} runs are going on' if meant else 'no run was started in this folder'
        listed = ', '.join(each.title for each in meant or entries)
        raise KhrError(f'{where}; name one with --domain or ROS_DOMAIN_ID: {listed}')
    which = f' in domain {domain}' if domain is not None else ''
    raise KhrError(f'no run is going on{which}; start one with "khr run SCENARIO"')


def _claim_domain(domain: int | None, held: ExitStack) -> tuple[int, tuple[int, ...]]:
    """Return a domain and its locks; ``held`` releases it."""
    for number in DOMAINS if domain is None else [domain]:
        with ExitStack() as kept:
            lock = _lock_domain(number, kept)
            port = _bind_port(number, kept) if lock is not None else None
            # A domain that is given by number may be shared with others.
            if lock is None or port is None or (domain is None and _in_use(number)):
                continue
            held.push(kept.pop_all())
            return number, (lock, port)
    if domain is not None:
        raise KhrError(f'--domain: {domain} is taken by another run; accepted: a free one')
    for number in DOMAINS:
        lock = _lock_domain(number, held)
        if lock is not None:
            return number, (lock,)
    raise KhrError('no free ROS domain')


def _lock_domain(domain: int, held: ExitStack) -> int | None:
    """Lock the file of a domain for this process and its children; None if it is locked."""
    file = _lock_file(domain)
    lock = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    try:
        fcntl.fcntl(lock, fcntl.F_OFD_SETLK, _FLOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0))
    except OSError:
        os.close(lock)
        return None
    held.callback(os.close, lock)
    return lock


def _bind_port(domain: int, held: ExitStack) -> int | None:
    """Bind the port that marks a domain as taken for all users; None if it is bound."""
    port = held.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    try:
        port.bind(('127.0.0.1', ports_of(domain).start + CLAIM))
    except OSError:
        return None
    return port.fileno()


def _lock_file(domain: int | str) -> Path:
    return register() / f'{domain}.lock'


def _forget(path: Path) -> None:
    """Remove an entry, unless its domain is locked by a new run."""
    with ExitStack() as held:
        if not path.stem.isdecimal() or _lock_domain(int(path.stem), held) is not None:
            path.unlink(missing_ok=True)


def _is_locked(domain: int) -> bool:
    """Return whether a process has locked the file of a domain."""
    try:
        lock = os.open(_lock_file(domain), os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    except FileNotFoundError:
        return False
    try:
        asked = _FLOCK.pack(fcntl.F_WRLCK, os.SEEK_SET, 0, 0, 0)
        (kind, *_) = _FLOCK.unpack_from(fcntl.fcntl(lock, fcntl.F_OFD_GETLK, asked))
    finally:
        os.close(lock)
    return bool(kind != fcntl.F_UNLCK)


def _in_use(domain: int) -> bool:
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
