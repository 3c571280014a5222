"""What khr export prints can be pasted into a shell."""

import shlex

from khr.cli.verbs.recordings import _export_motion
from khr_bringup.scenario.scenario import load_scenario
from tests import ROOT


def test_the_settings_of_an_exported_motion_are_quoted(tmp_path, capsys):
    file = tmp_path / 'my walk.csv'
    squat = ROOT / 'examples/squat.yaml'
    _export_motion(str(squat), file)
    words = shlex.split(capsys.readouterr().out.splitlines()[-1].removeprefix('play it with '))
    assert words[::2] == ['--set'] * (len(words) // 2)
    played = load_scenario(str(squat)).set_to(words[1::2]).of('gait')
    assert (played['motion_file'], played['repeat']) == (str(file), [0.0, 2.5])
