"""``khr doctor``: check the requirements of a run."""

from __future__ import annotations

import importlib.metadata
import os
import re
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.markup import escape

from khr_bringup.graph.run_registry import WITHOUT_LOG, register, registered, running
from khr_common import RunError
from khr_common.arithmetic import PORTABLE, in_force, warning
from khr_sim.physics import engines

# Requirements that no package declares, or as an extra: ROS, physics engines, PettingZoo.
PYTHONS = ((3, 11), (3, 12))
UNDECLARED = ('rclpy', 'ros-rmw-fastrtps-cpp', *engines.LIBRARIES.values(), 'pettingzoo')
ROOM = 1.0  # GB of disk below which a recording is at risk
OWN_FOLDER = 'set XDG_RUNTIME_DIR to a folder of your own'
Finding = tuple[bool, str, str]
GONE = 5.0  # s of wall time within which the child of a killed process ends
TABLES = (Path('/proc/net/udp'), Path('/proc/net/udp6'))
_LOOPBACK = '0100007F'  # 127.0.0.1 as /proc/net/udp writes it
_CHILD = 'from khr_common.processes import end_with_parent as e; e(); print(flush=True); input()'
_PARENT = f"""
import os, subprocess, sys
from khr_common.processes import PARENT
own = {{**os.environ, PARENT: str(os.getpid())}}
subprocess.Popen([sys.executable, '-c', {_CHILD!r}], env=own)
input()
"""


def examine(console: Console) -> int:
    """Print one line per check; return 0 if all are good, 1 otherwise."""
    good = True
    for fine, text, advice in _findings():
        good &= fine
        mark = '[green]ok [/green]' if fine else '[red]bad[/red]'
        said = escape(text if fine else f'{text} -> {advice}')
        console.print(f'{mark} {said}', highlight=False, soft_wrap=True)
    return 0 if good else 1


def _findings() -> Iterator[Finding]:
    yield python()
    yield arithmetic()
    yield from map(_version, packages())
    yield from map(_extension, extensions())
    for check in (middleware, register_is_private, discovery, closed, children_end, disk, runs):
        yield check()


def python() -> Finding:
    """Check the interpreter: the wheels of ROS are for 3.11 and 3.12."""
    version = '.'.join(map(str, sys.version_info[:3]))
    return sys.version_info[:2] in PYTHONS, f'Python {version}', 'use Python 3.11 or 3.12'


def arithmetic() -> Finding:
    """Check that results do not depend on the processor."""
    found = in_force()
    return found == PORTABLE, f'arithmetic {found}', warning()


def packages() -> list[str]:
    """Return the distributions of this project and their declared requirements."""
    homes = importlib.metadata.packages_distributions()
    queue = [*UNDECLARED, homes.get('khr', ['khr'])[0]]
    found: dict[str, str] = {}  # by the name that stands for all its spellings
    for package in queue:  # extended in the loop
        key = re.sub(r'[-_.]+', '-', package).lower()
        if key in found:
            continue
        found[key] = package
        with suppress(importlib.metadata.PackageNotFoundError):
            declared = importlib.metadata.requires(package) if key.startswith('khr') else None
            queue += [
                re.split(r'[^\w.-]', each, maxsplit=1)[0]
                for each in declared or ()
                if 'extra ==' not in each
            ]
    return sorted(found.values(), key=lambda each: (not each.startswith('khr'), each.lower()))


def _version(package: str) -> Finding:
    try:
        return True, f'{package} {importlib.metadata.version(package)}', ''
    except importlib.metadata.PackageNotFoundError:
        return False, f'{package} is missing', 'run make install'


def extensions() -> list[importlib.metadata.EntryPoint]:
    """Return the nodes of packages outside this project."""
    own = {re.sub(r'[-_.]+', '-', each).lower() for each in packages()}
    return [
        each
        for each in importlib.metadata.entry_points(group='khr.nodes')
        if each.dist and re.sub(r'[-_.]+', '-', each.dist.name).lower() not in own
    ]


def _extension(entry: importlib.metadata.EntryPoint) -> Finding:
    name = entry.dist.name if entry.dist else entry.module
    text = f'extension {name}: node {entry.name}'
    try:
        entry.load()
    except Exception as error:  # whatever a foreign package raises while it is imported
        said = ' '.join(str(error).split())
        return False, f'{text}: {type(error).__name__}: {said}', f'pip uninstall {name}'
    return True, text, ''


def middleware() -> Finding:
    """Check that ROS 2 starts, and with which middleware."""
    try:
        from rclpy.utilities import get_rmw_implementation_identifier

        return True, f'middleware {get_rmw_implementation_identifier()}', ''
    except Exception as error:  # whatever the import of a broken installation raises
        return (
            False,
            f'rclpy does not start: {error}',
            "pip install 'ros-jazzy-rclpy[fastrtps]', or source a ROS 2 Jazzy installation",
        )


def discovery() -> Finding:
    """Check that two nodes of a run's own domain find each other, and how fast."""
    try:
        seconds, _ = _discover()
    except Exception as error:  # the middleware's own errors have no common base
        return False, f'discovery failed: {error}', 'look at ROS_* and RMW_* variables'
    return (
        seconds < 3.0,
        f'discovery within one machine {seconds:.2f} s',
        'clean dead shared memory with "fastdds shm clean"; check that /dev/shm has room',
    )


def closed() -> Finding:
    """Check that no socket of a run is reachable from other machines."""
    try:
        _, found = _discover()
    except Exception as error:  # as above
        return False, f'sockets were not tried: {error}', 'look at ROS_* and RMW_* variables'
    return (
        not found,
        'a run listens on the loopback alone' if not found else f'open: {", ".join(found)}',
        'unset FASTDDS_* and RMW_* variables that change the transports',
    )


@cache
def _discover() -> tuple[float, list[str]]:
    """Return the discovery time of two nodes in a domain of their own, s, and their sockets."""
    with ExitStack() as held:
        folder = held.enter_context(TemporaryDirectory())
        entry = held.enter_context(registered('doctor', Path(folder)))
        os.environ.update(entry.environment())
        import rclpy
        from std_msgs.msg import String

        from khr_common.nodes.node import DATA

        contexts = [rclpy.Context(), rclpy.Context()]
        for context in contexts:
            rclpy.init(args=WITHOUT_LOG, context=context)
            held.callback(rclpy.try_shutdown, context=context)
        nodes = [
            rclpy.create_node(f'doctor_{i}', context=context) for i, context in enumerate(contexts)
        ]
        publisher = nodes[0].create_publisher(String, 'doctor', DATA)
        nodes[1].create_subscription(String, 'doctor', lambda _: None, DATA)
        start = time.monotonic()
        while publisher.get_subscription_count() == 0 and time.monotonic() - start < 10.0:
            time.sleep(0.005)
        return time.monotonic() - start, open_sockets()


def open_sockets() -> list[str]:
    """Return this process's UDP sockets that other machines may reach, from ``/proc/net``.

    Addresses are in hexadecimal, as in ``/proc/net/udp`` and ``/proc/net/udp6``.
    """
    own = set()
    for path in Path('/proc/self/fd').iterdir():
        with suppress(OSError):
            found = re.fullmatch(r'socket:\[(\d+)\]', os.readlink(path))
            own |= {found[1]} if found else set()
    tables = [path for path in TABLES if path.exists()]  # without IPv6 there is one
    lines = [line.split() for path in tables for line in path.read_text().splitlines()[1:]]
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
        return False, str(error), OWN_FOLDER


def disk() -> Finding:
    """Check the room for recordings: a minute of the graph is about 20 MB."""
    free = shutil.disk_usage(Path.cwd()).free / 1e9
    return free > ROOM, f'{free:.1f} GB free here', 'make room, or run with --out or --no-record'


def runs() -> Finding:
    """List the active runs."""
    try:
        entries = running()
    except RunError as error:
        return False, f'runs cannot be listed: {error}', OWN_FOLDER
    listed = ', '.join(f'{each.scenario} (ROS_DOMAIN_ID={each.domain})' for each in entries)
    many = f'{len(entries) or "no"} run{"s" if len(entries) > 1 else ""} going on'
    return True, f'{many}: {listed}' if listed else many, ''
