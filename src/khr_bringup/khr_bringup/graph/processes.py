"""The processes of a run: start, watch, stop in order, reap."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

from khr_common.processes import PARENT, tied_to_parent

EXECUTABLE = '--executable'  # instead of a module: see khr_bringup.graph.child
LAST = ('recorder', 'graph')  # they write the bag, with the last messages of the others
GRACE = 20.0  # s of wall time before a process that does not stop is killed; ten end at a time
FROZEN = 15.0  # s of wall time after which a process that a signal has stopped ends the run
# Everything was closed, but threads of the middleware kept the process alive until its own SIGALRM.
KILLED_BY_TIMER = -signal.SIGALRM
STOPPED_AS_IT_STARTED = -signal.SIGINT  # before it had anything to close
WELL = (0, KILLED_BY_TIMER, STOPPED_AS_IT_STARTED)
POLL = 0.02  # s of wall time between looks at a process that is to end
CLOSING = 25.0  # GRACE of a process with listeners to wait for, or a bag to finish


class Processes:
    """Child processes by name, each in its own session, so that Ctrl-C reaches this process alone.

    Args:
        environment: added to this process's environment.
        log: folder for one log file per process.
        locks: file descriptors that all inherit.
        first: the process that is stopped first; it waits for the listeners.

    Raises:
        OSError: if the folder cannot be written.
    """

    def __init__(
        self,
        environment: dict[str, str],
        log: Path,
        locks: tuple[int, ...] = (),
        first: str = 'simulator',
    ) -> None:
        # One thread per process: linear algebra here is small, and ten pools fight for cores.
        single = {'OMP_NUM_THREADS': '1', 'OPENBLAS_NUM_THREADS': '1'}
        own = {**single, PARENT: str(os.getpid()), 'ROS_LOG_DIR': str(log)}
        self._environment = {**os.environ, **environment, **own}
        self._log = log
        self._locks = locks
        self._children: dict[str, subprocess.Popen[bytes]] = {}
        self._first, self._foreign = first, set[str]()
        self._moved: dict[str, float] = {}  # when each was last seen not to be frozen
        log.mkdir(mode=0o700, parents=True, exist_ok=True)

    def start(
        self,
        name: str,
        nodes: Sequence[str],
        parameters: Sequence[Path],
        remaps: Sequence[str] = (),
    ) -> None:
        """Start nodes in one process, with parameter files, and its output in ``name.log``.

        Args:
            name: of the process.
            nodes: their entry points, such as ``khr_sim.sensors:GYRO``; see
                khr_common.nodes.run.
            parameters: the parameter files; later ones win.
            remaps: rules for names of topics, such as ``clock:=/clock``.
        """
        ros = [
            '--ros-args',
            '--disable-external-lib-logs',  # a second file for each process; all is in name.log
            *(word for file in parameters for word in ('--params-file', str(file))),
            *(word for rule in remaps for word in ('-r', rule)),
        ]
        self.start_module(name, 'khr_common.nodes.run', [*nodes, *ros])

    def start_executable(self, name: str, path: Path, arguments: Sequence[str]) -> None:
        """Start a foreign executable; its exit code counts only until it is asked to stop."""
        self._foreign.add(name)
        self.start_module(name, EXECUTABLE, [str(path), *arguments])

    def start_module(self, name: str, module: str, arguments: list[str]) -> None:
        """Start a module with its output in ``name.log``; it ends with this process."""
        path, for_this_user = self._log_of(name), partial(os.open, mode=0o600)
        with open(path, 'wb', opener=for_this_user) as log, _sigint_blocked():
            self._children[name] = subprocess.Popen(
                [sys.executable, '-m', 'khr_bringup.graph.child', module, *arguments],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                pass_fds=self._locks,
                preexec_fn=tied_to_parent(),
            )

    def ended(self) -> str | None:
        """Describe a process of the run that has ended or is frozen."""
        now = time.monotonic()
        for name, child in self._children.items():
            code = child.poll()
            if code is not None:
                return self._describe_end(name, code)
            since = self._moved.setdefault(name, now)
            if not _frozen(child.pid):
                self._moved[name] = now
            elif now - since > FROZEN:
                return f'{name} has been stopped by a signal for {FROZEN:g} s'
        return None

    def _log_of(self, name: str) -> Path:
        return self._log / f'{name.replace("/", "_")}.log'

    def _describe_end(self, name: str, code: int) -> str:
        how = f'was killed by {signal.Signals(-code).name}' if code < 0 else f'ended with {code}'
        lines: list[str] = []
        with suppress(OSError):  # somebody may have removed the folder
            log = self._log_of(name)
            lines = log.read_text(errors='replace').strip().splitlines()
        reason = f': {lines[-1]}' if lines else ''
        if any(line.startswith('Traceback') for line in lines):
            reason += f'; more in {log}'
        return f'{name} {how}{reason}'

    def interrupt(self, name: str) -> None:
        """Send SIGINT to one process."""
        child = self._children[name]
        if child.poll() is None:
            child.send_signal(signal.SIGINT)

    def stop(self) -> str | None:
        """Stop all processes, the recorder last; kill those that do not stop in time.

        Returns:
            A description of the processes that did not end well; None if all did.
        """
        others = set(self._children) - {self._first, *LAST}
        failed = []
        for group, patience in (({self._first}, CLOSING), (others, GRACE), (LAST, CLOSING)):
            names = [name for name in self._children if name in group]
            for name in names:
                self.interrupt(name)
            end = time.monotonic() + patience
            for name in names:
                child = self._children[name]
                if not _ended(child, end):
                    child.kill()
                    child.wait()
                    failed.append(f'{name} did not end when it was asked to, and was killed')
                elif child.returncode not in WELL and name not in self._foreign:
                    failed.append(self._describe_end(name, child.returncode))
        self._remove_empty_logs()
        return '; '.join(failed) or None

    def _remove_empty_logs(self) -> None:
        for name in self._children:
            log = self._log_of(name)
            with suppress(OSError):  # somebody may have removed the folder
                if log.stat().st_size == 0:
                    log.unlink()


@contextmanager
def batch_scheduling() -> Iterator[None]:
    """Let this process and its children wait for a free core (SCHED_BATCH).

    No message is urgent then, and preempting the sender costs both processes time.
    """
    ordinary = os.sched_getscheduler(0) == os.SCHED_OTHER
    if ordinary:
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
    try:
        yield
    finally:
        if ordinary:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Block SIGINT in the child until it has its handlers."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _ended(child: subprocess.Popen[bytes], end: float) -> bool:
    """Wait for the end of a process until a deadline; return whether it has ended."""
    while child.poll() is None:
        if time.monotonic() > end or _frozen(child.pid):
            return False
        time.sleep(POLL)
    return True


def _frozen(pid: int) -> bool:
    """Return whether a process is stopped by a signal, so that it cannot end by itself."""
    try:
        return Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()[0] == 'T'
    except OSError:
        return False
