"""A worker process: compute what comes over one pipe, answer over another.

It ends with the process that started it: the kernel kills it, also before this begins, and the
end of its pipe of tasks ends it.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
from multiprocessing.connection import Connection
from queue import SimpleQueue
from threading import Thread
from typing import Any


def serve(tasks: Connection, answers: Connection) -> None:
    """Answer one task after the other until the process is ended."""
    received: SimpleQueue[bytes] = SimpleQueue()
    Thread(target=_receive, args=(tasks, received), daemon=True).start()
    while True:
        answer = _answer(received.get())
        try:
            answers.send_bytes(answer)
        except OSError:  # nobody wants it any more
            os._exit(1)


def _receive(tasks: Connection, received: SimpleQueue[bytes]) -> None:
    """Receive while the last task is still computed, so that the end is noticed at once."""
    try:
        while True:
            received.put(tasks.recv_bytes())
    except (OSError, EOFError):
        os._exit(1)


def _answer(task: bytes) -> bytes:
    """Compute a task; return whether it succeeded, with the result or the error, pickled."""
    try:
        function, arguments = pickle.loads(task)
        return pickle.dumps((True, function(*arguments)))
    except Exception as error:
        return _pickled(error)


def _pickled(error: Exception) -> bytes:
    answer: tuple[bool, Any] = (False, error)
    try:
        data = pickle.dumps(answer)
        pickle.loads(data)  # an error that cannot be read back is sent as its text
        return data
    except Exception:
        return pickle.dumps((False, RuntimeError(f'{type(error).__name__}: {error}')))


if __name__ == '__main__':
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the command decides what Ctrl-C ends
    serve(
        Connection(int(sys.argv[1]), writable=False), Connection(int(sys.argv[2]), readable=False)
    )
