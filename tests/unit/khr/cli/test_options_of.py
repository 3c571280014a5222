"""A command takes options, defaults and help from an API function."""

import inspect

import pytest

from khr import searches
from khr.cli.options_of import options_of


def command(function):
    """Return a command that keeps its arguments, and the list that it keeps them in."""
    kept = []
    return options_of(function)(lambda *given: kept.append(given)), kept


@pytest.mark.parametrize('function', [searches.critical, searches.tune])
def test_every_argument_but_progress_is_an_option_with_the_same_default_and_help(function):
    options = inspect.signature(command(function)[0]).parameters
    arguments = inspect.signature(function).parameters
    assert list(options) == [name for name in arguments if name != 'progress']
    for name, option in options.items():
        assert option.annotation.__metadata__[0].help
        assert option.default in (arguments[name].default, name == 'motion')


def test_flags_and_settings_are_arguments_of_the_function():
    verb, kept = command(searches.critical)
    verb(motion=False, set=['simulator.friction=0.3'])
    assert kept == [
        ({'motion': 'leg_lift', 'set': {'simulator.friction': 0.3}}, ['simulator.friction=0.3'])
    ]
    assert searches.condition_of('walk', 12.0, 0.0, 'rubber', False, {'simulator.friction': 0.3}, 'mujoco').changes == (
        (('simulator', 'friction'), 0.3), (('simulator', 'engine'), 'mujoco'),
    )  # fmt: skip
