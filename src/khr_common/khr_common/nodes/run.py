"""Run nodes in one process: ``python -m khr_common.nodes.run MODULE:SPEC ... --ros-args ...``."""

from __future__ import annotations

import importlib
import sys

from khr_common.block import NodeSpec
from khr_common.nodes.spin import run_nodes


def load_spec(entry: str) -> NodeSpec:
    """Return the specification that an entry point such as ``khr_sim.node_specs:GYRO`` names."""
    module, name = entry.split(':')
    spec: NodeSpec = getattr(importlib.import_module(module), name)
    return spec


def main() -> int:
    """Run the nodes named on the command line, before ``--ros-args``."""
    arguments = sys.argv[1:]
    if '--ros-args' in arguments:
        arguments = arguments[: arguments.index('--ros-args')]
    return run_nodes([load_spec(entry) for entry in arguments])


if __name__ == '__main__':
    raise SystemExit(main())
