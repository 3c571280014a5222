"""Jobs for a pool of workers; those that wait speak over named pipes."""

import os
import signal


def pid_once(folder: str) -> int:
    """Kill the process, but the second time return its number."""
    try:
        os.mkdir(f'{folder}/once')
    except FileExistsError:
        return os.getpid()
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


def unreadable() -> None:
    """Raise an error that cannot be pickled."""
    raise type('Local', (Exception,), {})('of its own')


def hold(pipe: str) -> None:
    """Tell the process number to who reads the pipe; wait until somebody does."""
    with open(pipe, 'w', encoding='utf-8') as file:
        file.write(str(os.getpid()))


def stay(pipe: str) -> None:
    """Tell the process number, and wait for ever."""
    hold(pipe)
    signal.pause()


def say(file: str, text: str) -> None:
    """Append a text to a file."""
    with open(file, 'a', encoding='utf-8') as lines:
        lines.write(text)
