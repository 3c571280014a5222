"""All nodes of a run in one process, on one events executor."""

from __future__ import annotations

import importlib
import sys
from typing import Any

from khr_bringup.node_registry import PACKAGES
from khr_common.nodes.node import KhrNode
from khr_common.nodes.spin import run_nodes


def node_class(node: str) -> type[Any]:
    """Return the class of a node of the graph by the node's name."""
    module = importlib.import_module(f'{PACKAGES[node]}.nodes.{node}')
    return next(
        each
        for each in vars(module).values()
        if isinstance(each, type)
        and issubclass(each, KhrNode)
        and each.__module__ == module.__name__
    )


def main() -> int:
    """Run the nodes named on the command line, before ``--ros-args``."""
    names = sys.argv[1 : sys.argv.index('--ros-args')]
    return run_nodes([node_class(name) for name in names])


if __name__ == '__main__':
    raise SystemExit(main())
