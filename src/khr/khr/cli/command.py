"""The ``khr`` command: an error or an interruption is one line on stderr."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from threading import Timer
from typing import Any, NoReturn

from khr_common.arithmetic import enter
from khr_common.errors import INTERRUPTED

FAST_DDS = 'rmw_fastrtps_cpp'


def main() -> None:
    """Run the command and exit.

    Exit codes: 2 for a user's mistake, 1 for a run or a system that failed, 130 after SIGINT,
    SIGTERM or SIGHUP.
    """
    _open_closed_streams()
    enter()
    _check_middleware()
    atexit.register(_end)  # before all others, so that it is called last
    _handle_signals(_exit_at_once)  # nothing has started yet
    try:
        from typer.exceptions import TyperException

        from khr.cli.app import InterruptedVerb, app
        from khr_common import KhrError, RunError

        verbs = app(''.join(sys.argv[1:2]))
    except (ImportError, MemoryError) as error:
        _leave_for_library(error)

    _handle_signals(_interrupt)
    sys.unraisablehook = _unraisable
    warnings.formatwarning = lambda message, *_: f'khr: {message}\n'
    if isinstance(
        sys.stdout, TextIOWrapper
    ):  # a path may hold characters that the terminal cannot show
        sys.stdout.reconfigure(errors='backslashreplace')
    try:
        _exit(verbs(standalone_mode=False) or 0)
    except TyperException as error:
        _leave(_usage(error), error.exit_code)
    except RunError as error:
        _leave(str(error), 1)
    except KhrError as error:
        _leave(str(error), 2)
    except OSError as error:
        where = f'{str(error.filename)!r}: ' if error.filename is not None else ''
        _leave(f'{where}{error.strerror or error}', 2 if where else 1)
    except UnicodeError as error:
        found = getattr(error, 'object', '')
        _leave(f'{found!r:.200} is not accepted; accepted: paths and texts in UTF-8', 2)
    except (InterruptedVerb, KeyboardInterrupt):
        _leave('interrupted', INTERRUPTED)
    except (ImportError, MemoryError) as error:
        _leave_for_library(error)


def _open_closed_streams() -> None:
    """Let stdin, stdout and stderr that were closed (``>&-``) lead to the null device.

    Else the next files that are opened have their numbers.
    """
    for number, name in enumerate(('stdin', 'stdout', 'stderr')):
        try:
            os.fstat(number)
        except OSError:
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)  # the lowest number is free
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(number, 'w' if number else 'r', closefd=False))


def _check_middleware() -> None:
    """Exit if ``RMW_IMPLEMENTATION`` names a middleware that is not there.

    The library of rclpy would end the process while it is imported. A variable that was exported
    for a sourced ROS installation also reaches the rclpy of a virtual environment, which has Fast
    DDS alone.
    """
    wanted = os.environ.get('RMW_IMPLEMENTATION') or FAST_DDS
    if wanted == FAST_DDS:
        return
    prefixes = [Path(p) for p in os.environ.get('AMENT_PREFIX_PATH', '').split(':') if p]
    rclpy = find_spec('rclpy')
    sourced = rclpy and any(Path(rclpy.origin or '').is_relative_to(each) for each in prefixes)
    if not (sourced and any((each / 'lib' / f'lib{wanted}.so').exists() for each in prefixes)):
        _leave(
            f'RMW_IMPLEMENTATION: {wanted!r} is not installed; accepted: {FAST_DDS}, or unset it',
            2,
        )


_interrupted: list[int] = []  # signals received
_codes: list[int] = []  # with which the command exits


def _end() -> None:
    """Keep the exit code of the command, whatever signals come or came."""
    # At its end the interpreter restores the default actions, but not an ignored signal: a late one
    # would end the process with another code.
    _handle_signals(signal.SIG_IGN)
    # After a KeyboardInterrupt has propagated out of exec(), as in an import, the interpreter kills
    # itself by SIGINT at its end, even if the exception was caught.
    if _interrupted and _codes:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):  # whoever read it is gone
                stream.flush()
        os._exit(_codes[-1])


def _exit(code: int) -> NoReturn:
    _codes.append(code)
    sys.exit(code)


def _handle_signals(handler: Callable[..., None] | signal.Handlers) -> None:
    """Install a handler of the signals that end a process; SIGINT and SIGHUP may be ignored."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if number == signal.SIGTERM or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def _exit_at_once(*_: object) -> NoReturn:
    os.write(2, b'khr: interrupted\n')
    os._exit(INTERRUPTED)


def _interrupt(number: int, _: object) -> None:
    _interrupted.append(number)
    raise KeyboardInterrupt


def _unraisable(dropped: Any) -> None:
    """Raise an interruption again that a destructor has dropped."""
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        again = Timer(0.02, os.kill, (os.getpid(), _interrupted[-1]))
        again.daemon = True
        again.start()
    else:
        sys.__unraisablehook__(dropped)


def _leave_for_library(error: Exception) -> NoReturn:
    """Exit after a failed import or allocation."""
    if _interrupted:  # an extension that was being imported replaced the KeyboardInterrupt
        _leave('interrupted', INTERRUPTED)
    if isinstance(error, MemoryError):
        _leave('out of memory; accepted: a larger limit (ulimit -v)', 1)
    _leave(f'{type(error).__name__}: {" ".join(str(error).split())}', 1)


def _usage(error: Any) -> str:
    """Return one line about a usage error; empty where the help was printed."""
    text = ' '.join(error.format_message().split()).rstrip('.')
    context = getattr(error, 'ctx', None)
    return f'{text}; see {context.command_path} --help' if text and context else text


def _leave(text: str, code: int) -> NoReturn:
    if text:
        print(f'khr: {text}', file=sys.stderr)
    _exit(code)


if __name__ == '__main__':
    main()
