"""The verbs of the ``khr`` command, in groups."""

from __future__ import annotations

from importlib import metadata
from pkgutil import resolve_name
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from khr_common.errors import KhrError

SETTERS = ('set',)  # verbs with a value that may be empty

# By name, because the command imports the module of its one verb alone.
PANELS: dict[str, dict[str, str]] = {
    'Run and look': {
        'run': 'runs:start_run',
        'bout': 'bouts:start_bout',
        'view': 'runs:view',
        'report': 'recordings:report',
        'film': 'recordings:film',
        'export': 'recordings:export',
        'verify': 'recordings:verify_bag',
        'recover': 'recordings:recover_bag',
        'scenarios': 'runs:list_scenarios',
        'doctor': 'runs:doctor',
    },
    'While it runs': {
        'list': 'live:list_runs',
        'get': 'live:get_parameter',
        'set': 'live:set_parameter',
        'switch': 'live:switch_scenario',
    },
    'Studies': {
        'critical': 'studies:critical',
        'tune': 'studies:tune',
        'push': 'pushes:push',
        'fights': 'studies:fights',
        'lines': 'thesis:lines',
        'sweep': 'studies:start_sweep',
        'map': 'studies:draw_stability_map',
        'gains': 'studies:slope_gains',
    },
    'The thesis': {
        'figure': 'thesis:figure',
        'reproduce': 'thesis:reproduce',
        'scoreboard': 'thesis:scoreboard',
        'calibrate': 'studies:calibrate',
        'engines': 'studies:engines',
        'stage3': 'studies:stage3',
    },
}


class _WithoutFlagTypes:
    """Help in which a flag has no type, because it takes no value."""

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options, flags without a type."""
        found: list[Any] = super().get_params(ctx)  # type: ignore[misc]
        for each in found:
            if getattr(each, 'is_flag', False):
                each.metavar = ''
        return found


class Command(_WithoutFlagTypes, TyperCommand):
    """A verb."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments of the verb.

        An empty text is refused, as that of a variable which the shell does not know, such as
        ``--board "$PORT"``, would silently mean the default.
        """
        if not ctx.resilient_parsing and ctx.info_name not in SETTERS:
            given, *_ = self.make_parser(ctx).parse_args([*args])  # texts, not converted yet
            for each in self.params:
                texts = given.get(each.name)
                if '' in (texts if isinstance(texts, (list, tuple)) else [texts]):
                    option = next((name for name in each.opts if name.startswith('--')), '')
                    raise KhrError(
                        f"{option or ctx.info_name}: '' is not accepted; accepted: a text with a "
                        'character or more' + (f', or no {option}' if option else '')
                    )
        return super().parse_args(ctx, args)


class InterruptedVerb(Exception):
    """A KeyboardInterrupt of a verb, of which typer would keep only the exit code."""


class Group(_WithoutFlagTypes, TyperGroup):
    """Verbs."""

    def invoke(self, ctx: Any) -> Any:
        """Call the verb.

        Raises:
            InterruptedVerb: if a signal ended it.
        """
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as error:
            raise InterruptedVerb from error


def _show_version(asked: bool) -> None:
    if asked:
        (distribution, *_) = metadata.packages_distributions()['khr']  # the whole, or a part
        print(f'khr {metadata.version(distribution)}')
        raise typer.Exit


def top(
    version: Annotated[
        bool,
        typer.Option('--version', help='Show the version.', callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Balance control of the KHR-3HV humanoid as a ROS 2 node graph."""


def app(first: str = '') -> typer.Typer:
    """Return the command.

    Args:
        first: its first argument; if that is a verb, the command has no other.
    """
    made = typer.Typer(cls=Group, no_args_is_help=True, pretty_exceptions_enable=False)
    made.callback()(top)
    known = {
        name: (verb, panel) for panel, verbs in PANELS.items() for name, verb in verbs.items()
    }
    for name in [first] if first in known else known:
        verb, panel = known[name]
        function = resolve_name(f'khr.cli.verbs.{verb}')
        made.command(name, cls=Command, rich_help_panel=panel)(function)
    if first not in known:
        made.add_typer(board_verbs(), name='board', rich_help_panel='The real robot')
    return made


def board_verbs() -> typer.Typer:
    """Return the verbs of the controller board."""
    from khr.cli.verbs.board import VERBS

    group = typer.Typer(
        cls=Group,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help='Look at a controller board RCB-4HV, or serve a virtual one.',
    )
    for verb in VERBS:
        group.command(verb.__name__, cls=Command)(verb)
    return group
