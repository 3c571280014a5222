"""A small command imports little: it ends sooner than the simulator is imported."""

import json
import subprocess
import sys

from khr.cli.app import PANELS

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
    command = [sys.executable, '-c', SCRIPT, *verbs]
    return set(json.loads(subprocess.run(command, check=True, capture_output=True).stdout))


def test_the_verbs_for_a_running_graph_import_no_arrays_and_no_scenarios():
    assert not imported(*PANELS['While it runs']) & HEAVY


def test_a_run_from_python_imports_neither_gymnasium_nor_pandas():
    code = 'import khr, sys; khr.run; print({"gymnasium", "pandas"} & sys.modules.keys())'
    assert subprocess.check_output([sys.executable, '-c', code], text=True) == 'set()\n'


def test_only_the_module_of_the_verb_is_imported():
    verbs = {each for each in imported('film') if each.startswith('khr.cli.verbs.')}
    assert verbs == {'khr.cli.verbs.recordings', 'khr.cli.verbs.options'}
    assert 'khr.cli.verbs.board' in imported('board')
