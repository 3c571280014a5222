"""Check the parameter files of a node, so that no value is dropped silently.

ROS 2 drops, without a warning, a block for a node of another name or namespace and a parameter
that the node does not declare.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from khr_common.block import GROUP
from khr_common.errors import named
from khr_common.parameters import ParameterError
from khr_common.strict_yaml import read_file

_LOADER = getattr(yaml, 'CSafeLoader', yaml.SafeLoader)
_SIMILAR = 0.85  # of 1: a name that differs by a letter
_PARAMETERS = 'ros__parameters'


@dataclass(frozen=True)
class ParameterBlock:
    """A block of a parameter file: the nodes that it is for, and the parameters that it names."""

    file: str
    nodes: str
    parameters: frozenset[str]

    @property
    def for_all(self) -> bool:
        """Return whether it is for nodes of whatever name."""
        return self._name in ('*', '**')

    @property
    def _name(self) -> str:
        return self.nodes.rpartition('/')[2]

    def holds_for(self, node: str) -> bool:
        """Return whether it is for a node, given by its full name."""
        words = (re.escape(word) for word in self.nodes.strip('/').split('/'))
        pattern = ''.join(_WILDCARDS.get(word, f'/{word}') for word in words)
        return re.fullmatch(pattern, node) is not None

    def is_meant_for(self, node: str) -> bool:
        """Return whether its name is that of a node, or nearly."""
        name = node.rpartition('/')[2]
        if self._name == name or not get_close_matches(self._name, [name], cutoff=_SIMILAR):
            return self._name == name
        from importlib.metadata import entry_points  # seldom needed, by every node

        return self._name not in entry_points(group=GROUP).names


_WILDCARDS = {re.escape('**'): r'(?:/\w+)*', re.escape('*'): r'/\w+'}


def files_in(arguments: Sequence[str]) -> list[str]:
    """Return the parameter files that the arguments of a ROS 2 executable name.

    Raises:
        ParameterError: if a file is not behind ``--ros-args``, where ROS 2 would ignore it.
    """
    files, of_ros = [], False
    for flag, file in pairwise(arguments):
        if flag in ('--ros-args', '--'):
            of_ros = flag == '--ros-args'
        elif flag == '--params-file' and not of_ros:
            raise ParameterError(
                f'{flag} {file}: not accepted here; accepted: --ros-args {flag} {file}'
            )
        elif flag == '--params-file':
            files.append(file)
    return files


def read_blocks(file: str) -> list[ParameterBlock]:
    """Return the blocks of a parameter file.

    Raises:
        KhrError: if the file cannot be read, or is no ROS 2 parameter file.
    """
    text = read_file(Path(file))
    try:
        return list(_blocks(file, '', yaml.load(text, _LOADER)))
    except (yaml.YAMLError, ValueError, LookupError, AttributeError, RecursionError) as error:
        reason = getattr(error, 'problem', None) or type(error).__name__
        raise ParameterError(
            f'{file}: {named(reason)}; accepted: a ROS 2 parameter file'
        ) from error


def check_blocks(
    blocks: Sequence[ParameterBlock], node: str, parameters: frozenset[str]
) -> list[str]:
    """Check the blocks of parameter files against a node.

    Args:
        blocks: of all files that the node was given.
        node: its full name.
        parameters: that it knows.

    Returns:
        Warnings about blocks that may be meant for another node.

    Raises:
        ParameterError: if a block names the node in another namespace, and none its own; or if
            its own block names a parameter that it does not know.
    """
    own = [block for block in blocks if block.holds_for(node)]
    for block in own:
        unknown = sorted(block.parameters - parameters)
        if unknown and not block.for_all:
            raise ParameterError(
                f'{block.file}: {block.nodes}: {named(unknown[0])}: no such parameter; accepted: '
                f'{", ".join(sorted(parameters))}'
            )
    name = node.rpartition('/')[2]
    missed = [block for block in blocks if block not in own and block.is_meant_for(node)]
    if missed and all(block.for_all for block in own):
        raise ParameterError(
            f'{missed[0].file}: {named(missed[0].nodes)} is not {node}; accepted: /**/{name}'
        )
    return [
        f'{block.file}: {block.nodes}: {key}: not a parameter of this node'
        for block in own
        for key in sorted(block.parameters - parameters)
    ]


def _blocks(file: str, above: str, document: Any) -> Iterator[ParameterBlock]:
    """Yield the blocks of a mapping; namespaces may be nested."""
    if not isinstance(document, Mapping):
        return
    for key, body in document.items():
        nodes = f'{above}/{str(key).strip("/")}'
        if isinstance(body, Mapping) and _PARAMETERS in body:
            yield ParameterBlock(file, nodes, frozenset(_names('', body[_PARAMETERS])))
        else:
            yield from _blocks(file, nodes, body)


def _names(above: str, body: Any) -> Iterator[str]:
    """Yield the full names of parameters, whose groups may be nested."""
    if not isinstance(body, Mapping):
        return
    for key, value in body.items():
        if isinstance(value, Mapping):
            yield from _names(f'{above}{key}.', value)
        else:
            yield f'{above}{key}'
