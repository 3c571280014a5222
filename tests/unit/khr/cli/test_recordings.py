"""Options of khr report and khr export that go together, and what they print."""

import shlex

import pytest
from typer.testing import CliRunner

from khr.cli.app import app
from khr.cli.verbs.recordings import _export_motion
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from tests import ROOT


def test_the_settings_of_an_exported_motion_are_quoted(tmp_path, capsys):
    file = tmp_path / 'my walk.csv'
    squat = ROOT / 'examples/squat.yaml'
    _export_motion(str(squat), file)
    words = shlex.split(capsys.readouterr().out.splitlines()[-1].removeprefix('play it with '))
    assert words[::2] == ['--set'] * (len(words) // 2)
    played = load_scenario(str(squat)).set_to(words[1::2]).of('gait')
    assert (played['motion_file'], played['repeat']) == (str(file), [0.0, 2.5])


def refused(*words):
    """Return the one line that refuses a command."""
    done = CliRunner().invoke(app(), [*map(str, words)])
    assert isinstance(done.exception, KhrError), done.output
    assert '\n' not in str(done.exception)
    return str(done.exception)


@pytest.mark.parametrize('option', ['--topic', '--axis'])
def test_the_charts_of_a_run_are_of_no_topic(tmp_path, option):
    out = tmp_path / 'charts.svg'
    says = refused('report', tmp_path, option, 'x', '--out', out)
    assert says.startswith(f'{option}: not accepted with --out ')
    assert not out.exists()


def test_the_motion_of_a_scenario_has_no_namespace(tmp_path):
    asked = 'export', 'stand_0deg', '--motion', '--out', tmp_path / 'motion.csv'
    assert refused(*asked, '--namespace', '/a').startswith('--namespace: stand_0deg has no bag')
