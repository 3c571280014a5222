"""Run nodes in one process: ``python -m khr_common.nodes.run MODULE:SPEC ... --ros-args ...``.

``ROBOT/MODULE:SPEC`` puts a node into the namespace of a robot.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pkgutil import resolve_name

from khr_common.block import NodeSpec
from khr_common.nodes.spin import run_nodes


def main() -> int:
    """Run the nodes named on the command line, before ``--ros-args``."""
    arguments = sys.argv[1:]
    if '--ros-args' in arguments:
        arguments = arguments[: arguments.index('--ros-args')]
    return run_nodes([_spec(entry) for entry in arguments])


def _spec(argument: str) -> NodeSpec:
    robot, _, entry = argument.rpartition('/')
    spec: NodeSpec = resolve_name(entry)
    return replace(spec, name=f'{robot}/{spec.name}') if robot else spec


if __name__ == '__main__':
    raise SystemExit(main())
