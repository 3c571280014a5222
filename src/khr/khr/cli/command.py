"""The ``khr`` command: a mistake, or an interruption at whatever moment, is one line."""

from __future__ import annotations

import sys
import warnings
from io import TextIOWrapper
from typing import Any, NoReturn

from khr.cli.interruption import interrupt, keep_interruptions, leave_at_once, on_signals
from khr_common.arithmetic import enter
from khr_common.errors import INTERRUPTED


def main() -> None:
    """Run the command; a user's mistake is one line on stderr and exit code 2."""
    enter()
    on_signals(leave_at_once)  # imports take longer than a finger takes to Ctrl-C
    try:
        from typer.exceptions import TyperException

        from khr.cli.app import app
        from khr_common import KhrError, RunError
    except (ImportError, MemoryError) as error:
        _leave(_of_library(error), 1)

    keep_interruptions()
    on_signals(interrupt)
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
