"""Options of a command from the signature and docstring of an API function."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_args, get_type_hints

import typer

from khr.arguments import Flag
from khr_bringup.scenario import scenario as scenarios

TYPES = {'scenario': str, 'set': list[str] | None, 'out': Path | None}  # on the command line
API_ONLY = ('progress',)
ARGUMENT = re.compile(r'^ {8}(\w+): (.*(?:\n {12}.*)*)', re.MULTILINE)


def options_of(
    function: Callable[..., Any],
) -> Callable[[Callable[[dict[str, Any], list[str]], None]], Callable[..., None]]:
    """Return a decorator that gives a verb the options of an API function.

    The verb receives the arguments of the function by name, and the texts of ``--set``. Defaults
    come from the signature, help from the docstring, names that differ from typer metadata of the
    annotation.
    """
    parameters = inspect.signature(function).parameters
    hints = _hints(function)
    options = {
        name: _option(parameter, hints[name], _help(function)[name])
        for name, parameter in parameters.items()
        if name not in API_ONLY
    }
    flags = {name: flag for name in options if (flag := _found(hints[name], Flag))}

    def decorate(verb: Callable[[dict[str, Any], list[str]], None]) -> Callable[..., None]:
        @wraps(verb)
        def command(**arguments: Any) -> None:
            texts = arguments['set'] or []
            for name, flag in flags.items():
                arguments[name] = flag.on if arguments[name] else flag.off
            arguments['set'] = {
                f'{node}.{key}': value
                for (node, key), value in scenarios.changes_of(texts).items()
            }
            verb(arguments, texts)

        command.__doc__ = inspect.getdoc(function).partition('\n\n')[0]  # type: ignore[union-attr]
        command.__signature__ = inspect.Signature(list(options.values()))  # type: ignore[attr-defined]
        command.__annotations__ = {name: each.annotation for name, each in options.items()}
        return command

    return decorate


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the types of parameters with metadata; the type returned may not be imported yet."""
    plain = inspect.unwrap(function)
    deferred = plain.__annotations__.get('return', '').strip("'")
    return get_type_hints(plain, localns={deferred: Any}, include_extras=True)


def _help(function: Callable[..., Any]) -> Mapping[str, str]:
    """Return the description of each argument from a docstring in Google style."""
    return {
        name: ' '.join(text.replace('``', '').split())
        for name, text in ARGUMENT.findall(function.__doc__ or '')
    }


def _option(parameter: inspect.Parameter, hint: Any, text: str) -> inspect.Parameter:
    default, kind = parameter.default, TYPES.get(parameter.name, hint)
    if flag := _found(hint, Flag):
        default, kind = default == flag.on, bool
    elif _found(hint, typer.models.ParameterInfo) and kind is hint:
        kind = get_args(hint)[0]
    declared = _found(hint, typer.models.ParameterInfo)
    names: list[Any] = [f'--{parameter.name}'] if kind is bool else []
    if isinstance(declared, typer.models.OptionInfo):
        names = [declared.default, *(declared.param_decls or ())]
    required = default is inspect.Parameter.empty
    shown = typer.Argument(help=text) if required else typer.Option(*names, help=text)
    return parameter.replace(
        kind=inspect.Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[kind, shown]
    )


def _found(hint: Any, kind: type) -> Any:
    """Return the first item of an annotation's metadata of a type, or None."""
    return next((each for each in get_args(hint)[1:] if isinstance(each, kind)), None)
