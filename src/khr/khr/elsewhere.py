"""An environment in a process of its own, which steps while the caller steps another.

Numbers are in memory that both share; a byte over a pipe says that they are there, and whatever is
not a step goes over the pipe as well. Nothing listens. To wake a process that sleeps takes a good
part of a step: who waits looks again and again for about a step's time before it sleeps.
"""

from __future__ import annotations

import os
import pickle
import select
import signal
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from mmap import mmap
from multiprocessing.connection import Connection, Pipe
from pathlib import Path
from subprocess import DEVNULL, Popen
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from khr.environment import OBSERVED, WEIGHTS, BalanceEnv
from khr_common import KhrError, RunError
from khr_common.lifeline import tied_to_parent
from khr_sweeps.pool import SINGLE_THREADED

PATIENCE = 0.002  # s that is looked before sleeping: a step on the slower engine takes 1.5 ms
STEADY = ('time', *(f'reward_{term}' for term in WEIGHTS))  # info of a step within an episode
RECORD = np.dtype(
    [
        ('autoreset', np.bool_),  # the step begins an episode
        ('action', np.float64, 2),
        ('observation', np.float32, len(OBSERVED)),
        ('reward', np.float64),
        ('terminated', np.bool_),
        ('truncated', np.bool_),
        ('info', np.float64, len(STEADY)),
    ],
    align=True,
)
Columns = dict[str, NDArray[Any]]
STEP, CALL = b's', b'c'  # asked: a step, or what a message says
DONE, REPLY = b'd', b't'  # answered: nothing but what is in the record, or a message


def start_worker(module: str, ends: Sequence[int], quiet: bool = False) -> Popen[bytes]:
    """Start a module as a process that computes for this one, and is killed with this thread.

    It has a process group of its own, so that Ctrl-C reaches the command alone.

    Args:
        module: is given the files' numbers as its arguments.
        ends: files that it is to have: its ends of pipes.
        quiet: whether its errors are dropped.

    Raises:
        OSError: if it cannot be started.
    """
    same_modules = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
    return Popen(
        [sys.executable, '-P', '-m', module, *map(str, ends)],
        pass_fds=ends,
        stdin=DEVNULL,
        stderr=DEVNULL if quiet else None,
        process_group=0,
        env=dict.fromkeys(SINGLE_THREADED, '1') | os.environ | {'PYTHONPATH': same_modules},
        preexec_fn=tied_to_parent(),
    )


def columns(file: int) -> Columns:
    """Return the records in a file by the names of what they hold: each has one of each."""
    records = np.frombuffer(mmap(file, 0), RECORD)
    return {name: records[name] for name in RECORD.names or ()}


def advance(environment: BalanceEnv, shared: Columns, index: int) -> dict[str, Any] | None:
    """Take the step that a record says and write there what came of it.

    Returns:
        The info, if it is not one that the record has room for.
    """
    if shared['autoreset'][index]:
        observation, info = environment.reset()
        reward, terminated, truncated = 0.0, False, False
    else:
        observation, reward, terminated, truncated, info = environment.step(
            shared['action'][index]
        )
    shared['observation'][index], shared['reward'][index] = observation, reward
    shared['terminated'][index], shared['truncated'][index] = terminated, truncated
    if tuple(info) != STEADY:
        return info
    shared['info'][index] = tuple(info.values())
    return None


def call(environment: BalanceEnv, name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """Return what a method returns, or an attribute."""
    found = environment.get_wrapper_attr(name)
    return found(*args, **kwargs) if callable(found) else found


class Elsewhere:
    """An environment in a process of its own, as the vector environment sees it.

    What is asked must be answered before anything else is asked.
    """

    def __init__(
        self, like: BalanceEnv, index: int, file: int, patience: float, starter: ThreadPoolExecutor
    ) -> None:
        self.observation_space, self.action_space = like.observation_space, like.action_space
        self._index, self._patience, self._waiting = index, patience, False
        asked, self._asked = Pipe(duplex=False)
        self._answers, answers = Pipe(duplex=False)
        self._poller = _poller(self._answers)
        with asked, answers:  # the process's ends, or neither side would see the other's end
            ends = asked.fileno(), answers.fileno(), file
            self._process = starter.submit(start_worker, 'khr.elsewhere', ends).result()

    def send(self, what: Any) -> None:
        """Send an object."""
        self._asked.send_bytes(pickle.dumps(what))

    def begin(self) -> None:
        """Begin the step that the record says."""
        self._write(STEP)

    def ask(self, name: str, *args: Any, **kwargs: Any) -> None:
        """Have a method called, or an attribute read."""
        data = pickle.dumps((name, args, kwargs))
        self._write(CALL)
        self._asked.send_bytes(data)

    def answer(self) -> Any:
        """Return what has been asked for; None after a step of which the record has all.

        Raises:
            KhrError: as the environment raised it.
        """
        try:
            _wait(self._poller, self._patience)
            done = os.read(self._answers.fileno(), 1) == DONE
            found = None if done else pickle.loads(self._answers.recv_bytes())
        except (OSError, EOFError):
            raise self._lost() from None
        self._waiting = False
        if isinstance(found, KhrError):
            raise found
        return found

    def settle(self) -> None:
        """Wait for an answer that is under way, and forget it."""
        while self._waiting:
            with suppress(KhrError):
                self.answer()

    def reset(self, **_: Any) -> Any:
        """Return the observation and the info of the reset that was asked for."""
        return self.answer()

    def set_wrapper_attr(self, name: str, value: Any) -> None:
        """Set an attribute."""
        self.ask('set_wrapper_attr', name, value)
        self.answer()

    def close(self) -> None:
        """Kill the process: it holds nothing but the environment, and may have been stopped."""
        self._process.kill()
        self._process.wait()
        self._asked.close()
        self._answers.close()

    def _write(self, byte: bytes) -> None:
        try:
            os.write(self._asked.fileno(), byte)
        except OSError:
            raise self._lost() from None
        self._waiting = True

    def _lost(self) -> RunError:
        self._waiting = False
        self._process.kill()
        code = self._process.wait()
        how = f'by signal {-code}' if code < 0 else f'with exit code {code}'
        return RunError(f'environment {self._index}: its process was ended {how}')


def _poller(pipe: Connection) -> select.poll:
    poller = select.poll()
    poller.register(pipe, select.POLLIN)
    return poller


def _wait(poller: select.poll, patience: float) -> None:
    """Wait until a pipe can be read: look for a while (s), then sleep."""
    until = perf_counter() + patience
    while not poller.poll(0):
        if perf_counter() > until:
            poller.poll()
        os.sched_yield()  # to the one waited for, should it have no core


def _serve(asked: Connection, answers: Connection, file: int) -> None:
    """Keep an environment for the process that started this one, until that ends."""
    scenario, render_mode, weights, index, patience = pickle.loads(asked.recv_bytes())
    environment = BalanceEnv(scenario, render_mode, weights)
    shared, poller = columns(file), _poller(asked)
    while True:
        _wait(poller, patience)
        if os.read(asked.fileno(), 1) == STEP:
            reply = _answered(partial(advance, environment, shared, index))
        else:  # or an end, after which there is nothing to receive
            reply = _answered(partial(call, environment, *pickle.loads(asked.recv_bytes())))
        os.write(answers.fileno(), DONE if reply is None else REPLY)
        if reply is not None:
            answers.send_bytes(reply)


def _answered(do: Callable[[], Any]) -> bytes | None:
    """Return a result or the error in its place, pickled; None if it is None."""
    try:
        found = do()
        return None if found is None else pickle.dumps(found)
    except KhrError as error:
        return pickle.dumps(KhrError(str(error)))
    except Exception as error:
        return pickle.dumps(RunError(f'{type(error).__name__}: {error}'))


if __name__ == '__main__':
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller decides what Ctrl-C ends
    _asked, _answers, _file = map(int, sys.argv[1:])
    try:
        _serve(Connection(_asked, writable=False), Connection(_answers, readable=False), _file)
    except (EOFError, OSError):  # nobody wants it any more
        os._exit(1)
