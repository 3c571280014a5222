"""The ``khr`` command: a mistake, or an interruption at whatever moment, is one line."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from io import TextIOWrapper
from typing import Any, NoReturn

from khr_common.arithmetic import enter

INTERRUPTED = 130  # the shell's exit code for SIGINT


def main() -> None:
    """Run the command; a user's mistake is one line on stderr and exit code 2."""
    enter()
    _on_signals(_leave_at_once)  # imports take longer than a finger takes to Ctrl-C
    try:
        from typer.exceptions import TyperException

        from khr.cli.app import app
        from khr_common import KhrError, RunError
    except (ImportError, MemoryError) as error:
        _leave(_of_library(error), 1)

    _on_signals(signal.default_int_handler)
    warnings.formatwarning = lambda message, *_: f'khr: {message}\n'
    if isinstance(sys.stdout, TextIOWrapper):  # a path may hold what the terminal cannot show
        sys.stdout.reconfigure(errors='backslashreplace')
    try:
        sys.exit(app(standalone_mode=False) or 0)
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
    except KeyboardInterrupt:
        _leave('interrupted', INTERRUPTED)
    except (ImportError, MemoryError) as error:
        _leave(_of_library(error), 1)


def _on_signals(handler: Any) -> None:
    """Take the signals that ask a process to end; SIGINT and SIGHUP may be ignored."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if number == signal.SIGTERM or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handler)


def _leave_at_once(*_: object) -> None:
    """End without a word of what was interrupted: nothing has begun."""
    os.write(2, b'khr: interrupted\n')
    os._exit(INTERRUPTED)


def _of_library(error: Exception) -> str:
    """Report a library that cannot be loaded, or has no room to work in."""
    if isinstance(error, MemoryError):
        return 'out of memory; accepted: a larger limit (ulimit -v)'
    return f'{type(error).__name__}: {" ".join(str(error).split())}'


def _usage(error: Any) -> str:
    """Return one line about a mistake on the command line; empty after the help was printed."""
    text = ' '.join(error.format_message().split()).rstrip('.')
    context = getattr(error, 'ctx', None)
    return f'{text}; see {context.command_path} --help' if text and context else text


def _leave(text: str, code: int) -> NoReturn:
    if text:
        print(f'khr: {text}', file=sys.stderr)
    sys.exit(code)


if __name__ == '__main__':
    main()
