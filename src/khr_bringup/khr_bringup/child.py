"""A child process of a run: ``python -m khr_bringup.child MODULE ARGUMENTS``.

It ends with its parent, and what goes wrong while it loads is one line.
"""

from __future__ import annotations

import runpy
import signal
import sys

from khr_common.lifeline import end_with_parent


def main() -> None:
    """Run a module as the main program."""
    end_with_parent()
    # Until the module has its own handlers; a SIGINT that came before is taken now.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    del sys.argv[0]
    try:
        runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)
    except (ImportError, MemoryError, OSError, RuntimeError) as error:
        text = ' '.join(str(error).split())
        sys.exit(f'{sys.argv[0]}: {type(error).__name__}: {text}')


if __name__ == '__main__':
    main()
