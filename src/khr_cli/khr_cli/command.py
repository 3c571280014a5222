"""The ``khr`` command: its verbs in their order, and how a mistake is said."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable
from importlib import metadata
from typing import Annotated

import typer
from typer.exceptions import TyperException

from khr_cli.verbs import live, recordings, runs, studies, thesis
from khr_common import KhrError, RunError

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)
VERBS: dict[str, Callable[..., None]] = {
    'run': runs.run,
    'view': runs.view,
    'scenarios': runs.list_scenarios,
    'get': live.get_parameter,
    'set': live.set_parameter,
    'switch': live.switch_scenario,
    'doctor': runs.doctor,
    'figure': thesis.figure,
    'reproduce': thesis.reproduce,
    'lines': thesis.lines,
    'push': studies.push,
    'critical': studies.critical,
    'calibrate': studies.calibrate,
    'scoreboard': thesis.scoreboard,
    'engines': studies.engines,
    'tune': studies.tune,
    'stage3': studies.stage3,
    'film': recordings.film,
    'sweep': studies.sweep,
    'map': studies.draw_stability_map,
    'report': recordings.report,
    'verify': recordings.verify_bag,
    'recover': recordings.recover_bag,
}


def _show_version(asked: bool) -> None:
    if asked:
        (distribution, *_) = metadata.packages_distributions()['khr_cli']  # the whole, or a part
        print(f'khr {metadata.version(distribution)}')
        raise typer.Exit


@app.callback()
def top(
    version: Annotated[
        bool,
        typer.Option('--version', help='Show the version.', callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Balance control of the KHR-3HV humanoid as a ROS 2 node graph."""


for _name, _verb in VERBS.items():
    app.command(_name)(_verb)


def main() -> None:
    """Run the command; a user's mistake is one line on stderr and exit code 2."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends as Ctrl-C does
    try:
        sys.exit(app(standalone_mode=False) or 0)
    except TyperException as error:
        _leave(_usage(error), error.exit_code)
    except RunError as error:
        _leave(str(error), 1)
    except KhrError as error:
        _leave(str(error), 2)
    except OSError as error:
        where = f'{str(error.filename)!r}: ' if error.filename is not None else ''
        _leave(f'{where}{error.strerror or error}', 2 if where else 1)
    except KeyboardInterrupt:
        _leave('interrupted', 130)
    except MemoryError:
        _leave('out of memory; accepted: a larger limit (ulimit -v)', 1)


def _usage(error: TyperException) -> str:
    """Return one line about a mistake on the command line; empty after the help was printed."""
    text = ' '.join(error.format_message().split()).rstrip('.')
    context = getattr(error, 'ctx', None)
    return f'{text}; see {context.command_path} --help' if text and context else text


def _leave(text: str, code: int) -> None:
    if text:
        print(f'khr: {text}', file=sys.stderr)
    sys.exit(code)


if __name__ == '__main__':
    main()
