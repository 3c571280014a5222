"""Run the command in this process, which has imported already what it needs."""

import io
import os
import signal
import sys
import warnings
from contextlib import ExitStack, contextmanager, redirect_stderr, redirect_stdout
from unittest import mock

import pytest

from khr.cli import command
from tests.support.runs import Finished


def khr_here(*arguments):
    """Run khr to its end, as in a process of its own, but for what it imports."""
    out, err = io.StringIO(), io.StringIO()
    with ExitStack() as stack:
        stack.enter_context(kept())
        stack.enter_context(mock.patch('sys.argv', ['khr', *map(str, arguments)]))
        stack.enter_context(mock.patch.dict(os.environ, {'COLUMNS': '200'}))
        stack.enter_context(redirect_stdout(out))
        stack.enter_context(redirect_stderr(err))
        leave = stack.enter_context(pytest.raises(SystemExit))
        command.main()
    return Finished(leave.value.code, out.getvalue(), err.getvalue(), None)


@contextmanager
def kept():
    """Restore afterwards what the command replaces for the whole process."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    handlers = {number: signal.getsignal(number) for number in numbers}
    with (
        mock.patch.object(sys, 'unraisablehook', sys.unraisablehook),
        mock.patch.object(warnings, 'formatwarning', warnings.formatwarning),
    ):
        try:
            yield
        finally:
            for number, handler in handlers.items():
                signal.signal(number, handler)
