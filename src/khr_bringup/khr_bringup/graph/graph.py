"""A run as a node graph: start it, watch it, stop it, keep its files."""

from __future__ import annotations

import json
import os
import pwd
import resource
import time
from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from khr_bringup.graph.following import Callbacks, follow, interrupts
from khr_bringup.graph.processes import Processes, batch_scheduling
from khr_bringup.graph.run_registry import (
    CLAIM,
    FIRST_PARTICIPANT,
    WITHOUT_LOG,
    RunEntry,
    ports_of,
    write_entry,
)
from khr_bringup.graph.wiring import Robots, Wiring
from khr_bringup.result import Progress, Result
from khr_common import RunError
from khr_common.files import write_text
from khr_sim.run_parameters import RunParameters

SOCKETS = Path('/proc/net/udp')  # the kernel's table
PERIOD = 0.2  # s of wall time between looks for participants of other users
LEAST_MEMORY = 2**31  # bytes of address space; a process of a run takes about 1.2e9


@dataclass(frozen=True)
class RunOptions:
    """How to run a scenario."""

    offline: bool = False  # without ROS
    one_process: bool = False  # all nodes in one process instead of one each
    record: bool = True  # whether to write a bag
    domain: int | None = None  # of ROS; a free one by default
    network: bool = False  # whether other machines may join
    stay: bool = False  # whether the graph stays until it is interrupted
    driver_parameters: Path | None = None  # file for the executable that drives, if one does


def run_graph(
    robots: Robots,
    folder: Path,
    entry: RunEntry,
    options: RunOptions,
    callbacks: Callbacks,
    scenario_file: Path | None = None,
) -> list[Result]:
    """Run robots over topics until their run ends or is interrupted; register its state.

    Args:
        robots: one alone, or those of a round of a bout.
        folder: of the run; the parameter file and ``wiring.yaml`` are written there.
        entry: of the run in the register, with its ROS domain.
        options: how to run it.
        callbacks: to call meanwhile.
        scenario_file: to store in the bag; by default the parameter file.

    Returns:
        The result of each robot.

    Raises:
        RunError: if a node dies, or does not appear or answer in time, or another user joins;
            it is named, the rest is stopped and the bag closed.
    """
    write_entry(entry)
    _check_memory()
    began = time.monotonic()
    scenario, own = robots.first, folder / robots.file
    source = scenario_file or own
    wiring = Wiring.derive(robots, folder, options.record, options.stay, scenario_file=source)
    write_text(own, robots.text)
    files = [own, wiring.write(folder)]
    os.environ.update(entry.quiet_environment())
    members = robots.members(options.record)
    first = scenario.driver.first if scenario.driver else 'simulator'
    intruders = Intruders(entry.domain)
    processes = Processes(entry.environment(), folder / 'log', entry.locks, first)
    patient = not options.one_process and scenario.table(RunParameters).sync == 'lockstep'
    with interrupts() as interrupted, batch_scheduling() if patient else nullcontext():
        try:
            groups = (
                {'graph': members}
                if options.one_process
                else {member.label: [member] for member in members}
            )
            for name, group in groups.items():
                processes.start(name, [each.entry for each in group], files, robots.remaps)
            if scenario.driver is not None and scenario.driver.path is not None:
                processes.start_executable(
                    scenario.driver.name,
                    scenario.driver.path,
                    _arguments(wiring.driver_parameters(scenario), options.driver_parameters),
                )
            clock_process = 'graph' if options.one_process else first
            launched = time.monotonic() - began
            ending = replace(
                callbacks,
                finish=lambda: bool(interrupted) or callbacks.finish(),
                progress=note_progress(entry, callbacks.progress),
            )
            results = follow(
                robots,
                wiring.listeners,
                entry.run,
                ending,
                failed=lambda: processes.ended() or intruders.found(),
                stop=lambda: processes.interrupt(clock_process),
                endless=options.stay,
                simulator=scenario.driver.label if scenario.driver else clock_process,
                arguments=WITHOUT_LOG,
            )
        finally:
            failure = processes.stop()
            if interrupted:
                callbacks.interrupted()
    return [
        replace(result, failure=failure or '', startup=launched + result.startup)
        for result in results
    ]


def note_progress(entry: RunEntry, show: Callable[[Progress], None]) -> Callable[[Progress], None]:
    """Return a callback that shows progress, and keeps the state of the run in the register."""
    noted = entry

    def show_and_note(progress: Progress) -> None:
        nonlocal noted
        if progress.state != noted.state:
            noted = replace(entry, state=progress.state)
            write_entry(noted)
        show(progress)

    return show_and_note


def _arguments(shared: Mapping[str, Any], parameters: Path | None) -> list[str]:
    """Return the command line of a driver: parameters of the run, and a file of its own."""
    own = ['--params-file', str(parameters)] if parameters else []
    return [
        '--ros-args',
        *(
            word
            for name, value in shared.items()
            for word in ('-p', f'{name}:={json.dumps(value)}')
        ),
        *own,
    ]


def _check_memory() -> None:
    """Refuse a memory limit that is too low for the threads of the middleware."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY and limit < LEAST_MEMORY:
        raise RunError(
            f'ulimit -v: {limit // 1024} kB of address space is too small; accepted: at least '
            f'{LEAST_MEMORY // 1024} kB'
        )


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
