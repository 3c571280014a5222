"""Harm done to a run on the virtual board: what the robot does then, and what the run says."""

from __future__ import annotations

import re
import signal
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from std_srvs.srv import Trigger

from khr_hardware.virtual.faults import Fault, Faults
from tests.reliability.harms.harmed_run import BOTH, Case
from tests.support.runs import call, children, finish, joined, wait_for, wait_until
from tests.support.served import ServedRobot

SECONDS = 3.0  # of a run that survives its harm
NCK, FREED, KEPT = 'nck', 'free', 'keeps its last target'
# Replies that go wrong, and how many one after another: one exchange is tried three times.
LINES = tuple((kind, count) for kind in ('lost', 'late', 'corrupt', NCK) for count in (1, 2, 40))
OVER = 'silence', 'brownout'  # of the whole board
SIGNALS = ('SIGINT', 'SIGTERM', 'SIGKILL')


class Driven:
    """A run on a virtual board.

    Attributes:
        faults: all that fell short.
    """

    def __init__(self, folder: Path, mode: str, *options: str) -> None:
        self.faults: list[str] = []
        self.injected = Faults()
        self.served = ServedRobot(folder, faults=self.injected)
        self.process = self.served.drive('--no-record', mode, *options, patience=0.02)
        self._seen: list[psutil.Process] = []

    def start(self) -> None:
        """Start the robot, and wait until the clock goes."""
        with joined(self.served.folder) as node:
            answer = call(node, Trigger, 'board/start', Trigger.Request())
            if not answer.success:
                self.faults.append(f'start: {answer.message}')
            wait_until(node, 0.3)
        self._seen = list(children(self.process).values())

    def inject(self, *faults: Fault) -> None:
        """Let the board answer with faults from now on."""
        self.injected.add(*faults)

    def end(self, code: int, says: str = '') -> list[str]:
        """Wait for the end of the run; return what fell short."""
        ended = finish(self.process, self.served.folder, timeout=120)
        if ended.code != code:
            self.faults.append(f'exit {ended.code}: {ended.err.strip()[-300:]}')
        if not re.search(says, ended.err):
            self.faults.append(f'does not say {says}: {ended.err.strip()[-300:]}')
        if 'Traceback' in ended.err:
            self.faults.append(f'a traceback: {ended.err.strip().splitlines()[-1]}')
        return self.faults

    def robot(self, does: str) -> list[str]:
        """Compare what the robot does at the end; return what fell short."""
        _, alive = psutil.wait_procs(self._seen, timeout=5.0)
        if alive:
            self.faults.append(f'{len(alive)} processes left')
        free = len(self.served.free)
        if free != (len(self.served.map.numbers) if does == FREED else 0):
            self.faults.append(f'{free} servos are free; it {does}')
        return self.faults

    def close(self) -> None:
        """Put the robot away."""
        for each in (self.process, *self._seen):
            with suppress(psutil.Error, OSError):
                each.kill()
        self.served.__exit__()


def _line(case: Case, run: Driven) -> None:
    """Lose, delay, spoil or refuse replies: a few are lived through, many end the run by name."""
    few = case.phase != '40'
    run.inject(Fault(case.victim, count=int(case.phase)))
    run.end(0 if few else 1, '' if few else 'failed')
    run.robot(FREED)


def _board(case: Case, run: Driven) -> None:
    """Let the board fall silent, or start anew: the run ends by name, the robot is freed."""
    run.inject(Fault(case.victim, duration=3600.0))
    run.end(1, 'failed' if case.victim == 'silence' else 'failed|restarted')
    run.robot(FREED)


def _port(_: Case, run: Driven) -> None:
    """Pull the cable."""
    run.served.pull()
    run.end(1, 'the port is gone')
    run.robot(KEPT)


def _signal(case: Case, run: Driven) -> None:
    """Signal khr: the robot is freed, also if khr was killed."""
    run.process.send_signal(signal.Signals[case.victim])
    run.end({'SIGINT': 130, 'SIGTERM': 130, 'SIGKILL': -9}[case.victim])
    wait_for(lambda: run.served.free == run.served.map.numbers, 'free servos', 10.0)
    run.robot(FREED)


def _killed(case: Case, run: Driven) -> None:
    """Kill a process: a driver that is left frees the robot as it ends; else nobody does."""
    children(run.process)[case.victim].kill()
    run.end(1, f'{case.victim} was killed by SIGKILL')
    run.robot(KEPT if case.victim in ('board', 'graph') else FREED)


def _stopped(case: Case, run: Driven) -> None:
    """Freeze a node: without references the robot holds, and the run ends by name."""
    children(run.process)[case.victim].suspend()
    run.end(1, case.victim)
    run.robot(FREED)


_HARMS: dict[str, Callable[[Case, Driven], None]] = {
    'board: replies': _line,
    'board: silence, brown-out': _board,
    'board: port closed': _port,
    'board: signal to khr': _signal,
    'board: SIGKILL of a node': _killed,
    'board: SIGSTOP of a node': _stopped,
}


def harm(case: Case, folder: Path) -> list[str]:
    """Run on a board and do it some harm."""
    longest = SECONDS if case.kind == 'board: replies' and case.phase != '40' else 600.0
    run = Driven(folder, case.mode, '--duration', str(longest))
    try:
        run.start()
        _HARMS[case.kind](case, run)
        return run.faults
    except pytest.fail.Exception as error:  # what the tests' waiting raises; no Exception
        return [*run.faults, str(error)]
    finally:
        run.close()


HARMS = dict.fromkeys(_HARMS, harm)
SIGNALLED = (
    ('board: SIGKILL of a node', ('board', 'gait', 'ankle_controller')),
    ('board: SIGSTOP of a node', ('gait', 'ankle_controller')),
)


def cases(seed: int) -> list[Case]:
    """Return the cases of these harms."""
    return [
        *(Case('board: replies', mode, kind, str(count), seed)
          for mode in BOTH for kind, count in LINES),
        *(Case('board: silence, brown-out', mode, kind, '', seed) for mode in BOTH for kind in OVER),
        *(Case('board: port closed', mode, '', '', seed) for mode in BOTH),
        *(Case('board: signal to khr', mode, name, '', seed) for mode in BOTH for name in SIGNALS),
        *(Case(kind, '--processes', victim, '', seed)
          for kind, victims in SIGNALLED for victim in victims),
        Case('board: SIGKILL of a node', '--one-process', 'graph', '', seed),
    ]  # fmt: skip
