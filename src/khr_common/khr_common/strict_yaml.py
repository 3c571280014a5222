"""Read YAML strictly: plain data of limited size; errors are one line."""

from __future__ import annotations

import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from khr_common.errors import KhrError, named, quoted

LARGEST_FILE = 65_536  # bytes; every value of every node, comments included, takes 15,000
DEEPEST = 20  # collections within collections
LARGEST_INTEGER = 2**63  # exclusive; ROS 2 has integers of 64 bits


class YamlError(KhrError):
    """A file that is not YAML, or YAML outside the accepted subset."""


def read_file(path: Path) -> str:
    """Return the text of a file that is meant to be YAML.

    Raises:
        YamlError: if it cannot be read, is too large, or is not UTF-8.
    """
    try:
        with path.open('rb') as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise YamlError(f'{path}: {error.strerror}; accepted: a YAML file') from error
    try:
        text = content.decode('utf-8-sig')
    except UnicodeDecodeError as error:
        if len(content) <= LARGEST_FILE:
            raise YamlError(
                f'{path}: byte {error.start} is not UTF-8; accepted: YAML in UTF-8'
            ) from error
        text = ''
    _check_size(len(content), str(path))
    return text


def read_yaml(text: str, file: str) -> Any:
    """Read plain YAML: scalars, lists and mappings, each key once, no alias, anchor or tag.

    Args:
        text: at most 65,536 bytes, collections at most 20 deep.
        file: name of the file in error messages.
    """
    try:
        _check_size(len(text.encode()), file)
    except UnicodeEncodeError as error:  # half a pair: a path's byte that is not UTF-8
        raise YamlError(
            f'{named(file)}: {quoted(text[error.start])} is no character; accepted: YAML'
        ) from error
    try:
        _check_events(text)
        return yaml.load(text, _StrictLoader)
    except yaml.YAMLError as error:
        mark = getattr(error, 'problem_mark', None)
        where = f' line {mark.line + 1}, column {mark.column + 1}:' if mark else ''
        problem = getattr(error, 'problem', None) or str(error).splitlines()[0]
        reason = problem if isinstance(error, _Refusal) else named(problem)
        raise YamlError(f'{file}:{where} {reason}; accepted: YAML') from error


def _check_size(size: int, file: str) -> None:
    if size > LARGEST_FILE:
        raise YamlError(
            f'{named(file)}: too large; accepted: YAML of at most {LARGEST_FILE} bytes'
        )


class _Refusal(yaml.MarkedYAMLError):
    """YAML that is well formed and not accepted."""

    def __init__(self, problem: str, node: Any) -> None:
        super().__init__(problem=problem, problem_mark=node.start_mark)


def _check_events(text: str) -> None:
    """Refuse aliases, anchors, tags and deep nesting before any object is built."""
    event: Any
    depth = 0
    for event in yaml.parse(text, Loader=yaml.CSafeLoader):
        if isinstance(event, yaml.AliasEvent) or getattr(event, 'anchor', None):
            raise _Refusal('aliases and anchors are not accepted', event)
        if getattr(event, 'tag', None) not in (None, '!'):
            raise _Refusal(f'the tag {quoted(event.tag)} is not accepted', event)
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise _Refusal(f'collections more than {DEEPEST} deep are not accepted', event)


class _StrictLoader(yaml.CSafeLoader):
    """Build plain values; refuse duplicate keys and integers beyond 64 bits."""

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            value = super().construct_object(node, deep)
        except (ValueError, OverflowError) as error:  # 0b_, or too many digits for Python
            raise _Refusal(f'{quoted(node.value)} is not a number', node) from error
        if isinstance(value, int) and abs(value) >= LARGEST_INTEGER:
            raise _Refusal(f'{quoted(node.value)} is beyond 64 bits', node)
        return value

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, Hashable):
                raise _Refusal('a collection as a key is not accepted', key_node)
            if key in seen:
                raise _Refusal(f'key {quoted(key)} is given twice', key_node)
            seen.add(key)
        return super().construct_mapping(node, deep)


# Dates are no value of any parameter: they are read as text. 1e-3 is a number, as in ROS 2.
_StrictLoader.yaml_implicit_resolvers = {
    first: [pair for pair in resolvers if pair[0] != 'tag:yaml.org,2002:timestamp']
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_StrictLoader.add_implicit_resolver(
    'tag:yaml.org,2002:float',
    re.compile(r'[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$'),
    list('-+.0123456789'),
)
