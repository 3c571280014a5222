"""Options of verbs that come from an API function, repeated bouts, and what a verb imports."""

import inspect
import json
import os
import shlex
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace as Made

import pytest

from khr import searches
from khr.cli.app import PANELS
from khr.cli.options_of import options_of
from khr.cli.verbs import bouts as verb
from khr.cli.verbs.options import run_named
from khr.cli.verbs.recordings import _export_motion
from khr_bringup.bout.bout import load_bout
from khr_bringup.graph.graph import RunOptions
from khr_bringup.scenario.scenario import load_scenario
from khr_view import viewing
from khr_view.viewing import Observer, Viewing
from tests import ROOT


def test_the_settings_of_an_exported_motion_are_quoted(tmp_path, capsys):
    file = tmp_path / 'my walk.csv'
    squat = ROOT / 'examples/squat.yaml'
    _export_motion(str(squat), file)
    words = shlex.split(capsys.readouterr().out.splitlines()[-1].removeprefix('play it with '))
    assert words[::2] == ['--set'] * (len(words) // 2)
    played = load_scenario(str(squat)).set_to(words[1::2]).of('gait')
    assert (played['motion_file'], played['repeat']) == (str(file), [0.0, 2.5])


def test_last_is_the_run_started_last_whatever_was_written_into_others(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for age, name in enumerate(('new', 'old')):
        file = tmp_path / 'runs' / name / 'scenario.yaml'
        file.parent.mkdir(parents=True)
        file.touch()
        os.utime(file, (0, 100 - age))
        os.utime(file.parent, (0, age))
    assert run_named('last') == Path('runs/new')


def test_a_bout_is_repeated_only_while_a_browser_is_connected(monkeypatch):
    display, done = Made(readers=0), []

    def look(_):
        done.append('waits')
        display.readers = 1

    def run(*_):
        done.append('runs')
        if len(done) > 3:
            raise KeyboardInterrupt
        display.readers = 0

    observer = Observer(nullcontext, [Made(display=display)])
    monkeypatch.setattr(viewing.time, 'sleep', look)
    monkeypatch.setattr(verb, '_run', run)
    monkeypatch.setattr(verb, 'live_page', lambda *_, **__: nullcontext(observer))
    assert verb.view_bout(load_bout('shove'), RunOptions(), None, Viewing(again='same')) == 0
    assert done == ['runs', 'waits', 'runs', 'waits', 'runs']


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


SCRIPT = """
import json, sys
from khr.cli.app import app
for verb in sys.argv[1:]:
    app(verb)
print(json.dumps([*sys.modules]))
"""
HEAVY = {
    'numpy',
    'scipy',
    'pyarrow',
    'rosbags',
    'khr_bringup.scenario.scenario',
    'khr_sim.physics',
}


def imported(*verbs):
    """Return what some verbs import: a small one ends sooner than the simulator is imported."""
    command = [sys.executable, '-c', SCRIPT, *verbs]
    return set(json.loads(subprocess.run(command, check=True, capture_output=True).stdout))


def test_only_the_module_of_the_verb_is_imported_and_no_arrays_for_a_running_graph():
    live = imported(*PANELS['While it runs'])
    assert not live & HEAVY
    verbs = [each for each in live if each.startswith('khr.cli.verbs.')]
    assert verbs == ['khr.cli.verbs.live']


def test_a_run_from_python_imports_neither_gymnasium_nor_pandas():
    code = 'import khr, sys; khr.run; print({"gymnasium", "pandas"} & sys.modules.keys())'
    assert subprocess.check_output([sys.executable, '-c', code], text=True) == 'set()\n'
