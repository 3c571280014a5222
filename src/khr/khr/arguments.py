"""Check the arguments of the Python API: a wrong one is an error of one line.

pydantic is imported by the first call: the command loads this module at every start.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, wraps
from os import PathLike
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec, TypeAlias, TypeVar

from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.errors import one_line, quoted

if TYPE_CHECKING:
    from pydantic import ValidationError

P = ParamSpec('P')
Returned = TypeVar('Returned')


class _InstanceOf:
    """Have pydantic accept instances of a class as they are (``pydantic.InstanceOf``)."""

    def __get_pydantic_core_schema__(self, source: Any, _: Any) -> Any:
        from pydantic_core.core_schema import is_instance_schema

        return is_instance_schema(source)


ScenarioLike: TypeAlias = str | PathLike[str] | Annotated[Scenario, _InstanceOf()]
OPTION = '--'  # prefix of the command's options in error messages


@dataclass(frozen=True)
class Flag:
    """A text argument that is a pair of flags on the command line."""

    on: str
    off: str


def checked(function: Callable[P, Returned]) -> Callable[P, Returned]:
    """Decorate an API function: arguments that do not fit its signature raise a KhrError."""

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> Returned:
        from pydantic import ValidationError

        try:
            validated: Callable[P, Returned] = _validated(function)
            return validated(*given, **named)
        except ValidationError as error:
            raise KhrError(_text(function, error)) from None
        except KhrError as error:
            if not str(error).startswith(OPTION):
                raise
            raise type(error)(str(error).removeprefix(OPTION)) from None

    return call


@cache
def _validated(function: Callable[P, Returned]) -> Callable[P, Returned]:
    """Return a function with validation, which ignores its return type (a deferred import)."""

    from pydantic import validate_call

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> Returned:
        _check_paths(inspect.signature(function).bind(*given, **named).arguments)
        return function(*given, **named)

    call.__annotations__ = {
        name: kind for name, kind in function.__annotations__.items() if name != 'return'
    }
    validated: Callable[P, Returned] = validate_call(call)
    return validated


def _check_paths(arguments: Mapping[str, object]) -> None:
    """Refuse names and paths that no file can have.

    Raises:
        KhrError: if one has a character that is not in UTF-8, or a zero.
    """
    for name, value in arguments.items():
        if isinstance(value, (str, PathLike)):
            try:
                valid = b'\0' not in str(value).encode()
            except UnicodeEncodeError:
                valid = False
            if not valid:
                raise KhrError.refused(name, str(value), 'a text in UTF-8 without zeros')


def _text(function: Callable[..., object], error: ValidationError) -> str:
    """Return the first error as one line: the argument, its value and the accepted ones."""
    mistakes = error.errors(include_url=False)
    first, names = mistakes[0], list(inspect.signature(function).parameters)
    place = first['loc'][0]
    own = names[place] if isinstance(place, int) and place < len(names) else place
    if 'unexpected_positional' in first['type']:
        return (
            f'{function.__name__}: {quoted(first["input"])} is not accepted; accepted: as NAME=VALUE '
            '(keyword only)'
        )
    if 'unexpected' in first['type']:
        return f'{function.__name__}: {own!r} is not accepted; accepted: {", ".join(names)}'
    if 'missing' in first['type']:
        return f'{function.__name__}: {own} is missing; accepted: {", ".join(names)}'
    wanted = (
        'a path' if each['type'] == 'path_type' else each['msg'].partition(',')[0]
        for each in mistakes
        if each['loc'][0] == place
    )
    kinds = ' | '.join(dict.fromkeys(each.removeprefix('Input should be ') for each in wanted))
    return f'{own}: {one_line(quoted(first["input"]))} is not accepted; accepted: {kinds}'
