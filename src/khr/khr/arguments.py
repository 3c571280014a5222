"""Check the arguments of the functions that people call: a mistake is one line."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from os import PathLike
from typing import ParamSpec, TypeAlias, TypeVar

from pydantic import InstanceOf, ValidationError, validate_call

from khr_bringup.scenario.scenario import Scenario
from khr_common import KhrError
from khr_common.text.quoting import one_line, quoted

P = ParamSpec('P')
Returned = TypeVar('Returned')
ScenarioLike: TypeAlias = str | PathLike[str] | InstanceOf[Scenario]

OPTION = '--'  # what the command sets before the names of its arguments


def checked(function: Callable[P, Returned]) -> Callable[P, Returned]:
    """Have a function refuse arguments that it does not state with a :class:`KhrError`."""
    validated = validate_call(function)

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> Returned:
        try:
            return validated(*given, **named)
        except ValidationError as error:
            raise KhrError(_text(function, error)) from None
        except KhrError as error:
            if not str(error).startswith(OPTION):
                raise
            raise type(error)(str(error).removeprefix(OPTION)) from None

    return call


def _text(function: Callable[..., object], error: ValidationError) -> str:
    """Return the first mistake as one line: what, where, which value, what is accepted."""
    mistakes = error.errors(include_url=False)
    first, names = mistakes[0], list(inspect.signature(function).parameters)
    place = first['loc'][0]
    own = names[place] if isinstance(place, int) and place < len(names) else place
    if 'unexpected_positional' in first['type']:
        return f'{function.__name__}: {quoted(first["input"])} is not accepted; accepted: its name too'
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
