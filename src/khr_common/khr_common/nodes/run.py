"""Run nodes in one process: ``python -m khr_common.nodes.run MODULE:SPEC ... --ros-args ...``."""

from __future__ import annotations

import sys
from pkgutil import resolve_name

from khr_common.nodes.spin import run_nodes


def main() -> int:
    """Run the nodes named on the command line, before ``--ros-args``."""
    arguments = sys.argv[1:]
    if '--ros-args' in arguments:
        arguments = arguments[: arguments.index('--ros-args')]
    return run_nodes([resolve_name(entry) for entry in arguments])


if __name__ == '__main__':
    raise SystemExit(main())
