"""A child process of a run: ``python -m khr_bringup.graph.child MODULE ARGUMENTS``.

An error while it loads is one line. ``--executable PATH`` in the place of a module becomes
that executable.
"""

from __future__ import annotations

import os
import runpy
import signal
import sys
from pathlib import Path

from khr_bringup.graph.processes import EXECUTABLE


def main() -> None:
    """Run a module as the main program."""
    # Until the module has its own handlers; a SIGINT that came before is taken now.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    del sys.argv[0]
    try:
        if sys.argv[0] == EXECUTABLE:
            # Its python3 must have ROS, also where this environment is not activated.
            os.environ['PATH'] = f'{Path(sys.executable).parent}:{os.environ.get("PATH", "")}'
            os.execv(sys.argv[1], sys.argv[1:])
        runpy.run_module(sys.argv[0], run_name='__main__', alter_sys=True)
    except (ImportError, MemoryError, OSError, RuntimeError) as error:
        text = ' '.join(str(error).split())
        sys.exit(f'{sys.argv[0]}: {type(error).__name__}: {text}')


if __name__ == '__main__':
    main()
