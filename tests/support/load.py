"""Other work on this machine."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from khr_common.processes import tied_to_parent


@contextmanager
def busy(loops: int) -> Iterator[None]:
    """Keep so many cores busy; whatever ends this process ends the loops."""
    with ExitStack() as stack:
        for _ in range(loops):
            loop = subprocess.Popen(
                [sys.executable, '-c', 'while True: pass'], preexec_fn=tied_to_parent()
            )
            stack.callback(loop.wait)
            stack.callback(loop.kill)
        yield
