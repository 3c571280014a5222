"""A controller from a package of its own: in the graph, in the twin, in the bag, on the page."""

import base64
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from math import ceil
from pathlib import Path

import pytest

from khr_bringup.offline import run_offline
from khr_bringup.scenario.scenario import load_scenario
from tests import ROOT
from tests.support.runs import Bag

EXAMPLE = ROOT / 'examples' / 'khr_example_controller'
DOCUMENT = (ROOT / 'docs' / 'extending.md').read_text()
SECONDS = 1.5
pytestmark = pytest.mark.slow
TAIL = """
from dataclasses import dataclass
from khr_balance.feedback import FeedbackController, FeedbackParameters
from khr_common.block import NodeSpec
from khr_common.interfaces import GYRO, correction


@dataclass(frozen=True)
class TailParameters(FeedbackParameters):
    pass


class TailController(FeedbackController[TailParameters]):
    subscribes = (GYRO,)
    publishes = (correction('tail_controller', ('head_yaw',)),)

    def law(self, time, signals):
        return self.rate_gain * signals[GYRO][1]


TAIL_CONTROLLER = NodeSpec('tail_controller', 'tail_controller', TailParameters, TailController)
"""


@pytest.fixture(scope='module')
def python(tmp_path_factory):
    """Return the Python of an environment that has the example beside all that this one has."""
    folder = tmp_path_factory.mktemp('extension')
    subprocess.run([sys.executable, '-m', 'venv', '--without-pip', folder / 'venv'], check=True)
    own = folder / 'venv' / 'bin' / 'python'
    found = subprocess.run(
        [own, '-c', 'import sysconfig; print(sysconfig.get_path("purelib"))'],
        capture_output=True,
        text=True,
        check=True,
    )
    (Path(found.stdout.strip()) / 'parent.pth').write_text(sysconfig.get_path('purelib'))
    source = shutil.copytree(EXAMPLE, folder / 'source')
    tail = folder / 'tail'
    tail.mkdir()
    (tail / 'pyproject.toml').write_text(re.search(r'```toml\n(.*?)```', DOCUMENT, re.S)[1])
    (tail / 'tail_controller.py').write_text(TAIL)
    subprocess.run(
        [
            *(sys.executable, '-m', 'pip', '--python', own, 'install', '--quiet', '--no-deps'),
            *('--no-build-isolation', '--disable-pip-version-check', source, tail),
        ],
        check=True,
        env=environment(),
    )
    return own


def environment():
    """Return an environment in which the other Python finds the ROS libraries of this one."""
    kept = {key: value for key, value in os.environ.items() if key != 'PYTHONPATH'}
    return {**kept, 'ROS_PYTHON_CHECK_FIELDS': '1', 'COLUMNS': '200'}


def khr(python, *arguments, cwd=None):
    done = subprocess.run(
        [python, '-m', 'khr.cli.command', *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment(),
        cwd=cwd,
        timeout=110,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def run(python, folder, *arguments):
    """Run for SECONDS as the rest of a command says; return the trajectory hash."""
    less = ('--duration', SECONDS, '--no-draw', '--out', folder)
    return khr(python, 'run', *arguments, *less, cwd=ROOT).split()[-1]


@pytest.fixture(scope='module')
def documented():
    """Return the commands of the document: what follows pip install and khr run."""
    install, *runs = re.search(r'```sh\n(pip .*?)```', DOCUMENT, re.S)[1].splitlines()
    assert install.startswith('pip install ')
    words = [command.partition('#')[0].split() for command in runs]
    assert all(own[:2] == ['khr', 'run'] for own in words)
    return install.split()[2:], *(own[2:] for own in words)


@pytest.fixture(scope='module')
def recorded(python, documented, tmp_path_factory):
    """Return folder and hash of the document's first run, with one process per node."""
    folder = tmp_path_factory.mktemp('runs') / 'processes'
    _, first, _ = documented
    assert '--processes' in first
    return folder, run(python, folder, *first)


# One process is asked for all that does not need the command.
ASKED = """
import json, sys, khr
from pathlib import Path
from khr_bringup.offline import run_offline
from khr_bringup.recorded.verify import verify
from khr_bringup.scenario.scenario import load_scenario
from khr_report.run.panes import CORRECTIONS, panes_of
from khr_report.run.page import report
from khr_view.controls import tunables
from khr_view.charts.charts import charts
from tail_controller import TAIL_CONTROLLER
folder, nod = sys.argv[1:]
run = khr.load(folder)
lines = [line for pane in panes_of({'': run.signals}, [CORRECTIONS]) for line in pane.lines]
report(Path(folder), None, None)
short = {('simulator', 'duration'): 0.3}
walk, nodding = (load_scenario(name).changed(short) for name in ('walk_0deg', nod))
nods = []
run_offline(nodding, lambda _, loop, __: nods.extend(loop.signals[TAIL_CONTROLLER.publishes[0]]))
print(json.dumps({
    'verified': verify(Path(folder)),
    'signals': list(run.signals.controllers),
    'table': run.table()['correction_knee'].to_pylist(),
    'overview': [name for name, *_ in lines],
    'chart': [line.label for chart in charts() for line in chart.lines],
    'controls': [each.label for each in tunables()],
    'walk_0deg': run_offline(walk).trajectory_hash,
    'nods': nods,
}))
"""


@pytest.fixture(scope='module')
def told(python, recorded, tmp_path_factory):
    """Return what the other environment says of the run and of two scenarios."""
    nod = tmp_path_factory.mktemp('nod') / 'nod.yaml'
    nod.write_text(
        '/**/tail_controller:\n  ros__parameters:\n    enabled: true\n    gain: 12.0\n'
        '/**/gait:\n  ros__parameters:\n    motion: walk\n'
        '/**/simulator:\n  ros__parameters:\n    initial_tilt_deg: 1.0\n'
    )
    done = subprocess.run(
        [python, '-c', ASKED, recorded[0], nod],
        capture_output=True,
        text=True,
        env=environment(),
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def test_its_corrections_and_parameters_are_in_the_bag(recorded, told):
    folder, _ = recorded
    sent = [message for _, message in Bag(folder / 'bag')['/knee_controller/correction']]
    assert len(sent) == ceil(SECONDS / 0.015) + 1  # of every instant, the first included
    assert list(sent[0].name) == ['l_knee', 'r_knee']
    assert any(message.position[0] > 0.0 for message in sent)
    assert 'knee_controller' in (folder / 'scenario.yaml').read_text()
    assert told['verified'] == 0
    assert told['table'] == [message.position[0] for message in sent]


def test_it_is_in_signals_charts_sliders_and_report(recorded, told):
    folder, _ = recorded
    assert told['signals'] == ['ankle', 'hip', 'knee', 'tail']
    assert 'knee' in told['overview'] and 'knee' in told['chart']
    assert {'Knee control', 'Knee gain'} <= set(told['controls'])
    table = re.search(r'data:text/csv;base64,([\w+/=]+)', (folder / 'report.html').read_text())
    header = next(csv.reader(base64.b64decode(table[1]).decode().splitlines()))
    assert 'correction_knee, deg' in header


def test_its_own_tests_pass(python):
    done = subprocess.run(
        [python, '-m', 'pytest', '-q', '-p', 'no:cacheprovider', EXAMPLE / 'test'],
        capture_output=True,
        text=True,
        env=environment(),
        cwd=EXAMPLE,
        check=False,
    )
    assert done.returncode == 0, done.stdout


def test_three_files_are_enough_and_a_scenario_without_them_is_untouched(told):
    walk = load_scenario('walk_0deg').changed({('simulator', 'duration'): 0.3})
    assert told['walk_0deg'] == run_offline(walk).trajectory_hash
    assert len(told['nods']) == 21 and any(told['nods'])


def test_the_document_shows_the_example_and_its_runs_agree(python, documented, recorded, tmp_path):
    *_, second = documented
    assert '--offline' in second and run(python, tmp_path / 'offline', *second) == recorded[1]
    assert documented[0][-1] == str(EXAMPLE.relative_to(ROOT))
    excerpt = re.search(r'```python\n(.*?)```', DOCUMENT, re.S)[1]
    law = iter((EXAMPLE / 'khr_example_controller' / 'knee.py').read_text().splitlines())
    assert all(line in law for line in excerpt.splitlines() if line), 'not as in knee.py'
