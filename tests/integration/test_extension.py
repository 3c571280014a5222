"""A controller from a package of its own: in the graph, in the twin, in sweeps, in the bag."""

import base64
import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import sysconfig
from math import ceil
from pathlib import Path

import pytest
import yaml

from khr_bringup.graph import run_registry
from khr_sweeps.results.folder import read_results, request_of
from tests import ROOT
from tests.support.in_process import khr_here
from tests.support.runs import LONG, Bag, wait_for

EXAMPLE = ROOT / 'examples' / 'khr_example_controller'
SCENARIO = EXAMPLE / 'config' / 'walk_5deg_knee.yaml'
DOCUMENT = (ROOT / 'docs' / 'extending.md').read_text()
SECONDS = 1.5
pytestmark = pytest.mark.slow


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
    site = Path(found.stdout.strip())
    (site / 'parent.pth').write_text(sysconfig.get_path('purelib'))
    source = shutil.copytree(EXAMPLE, folder / 'source')
    subprocess.run(
        [
            *(sys.executable, '-m', 'pip', '--python', own, 'install', '--quiet', '--no-deps'),
            *('--no-build-isolation', '--disable-pip-version-check', source),
        ],
        check=True,
        env=environment(),
    )
    return own


def environment():
    """Return an environment in which the other Python finds the ROS libraries of this one."""
    kept = {key: value for key, value in os.environ.items() if key != 'PYTHONPATH'}
    return {**kept, 'ROS_PYTHON_CHECK_FIELDS': '1', 'COLUMNS': '200'}


def ended(python, *arguments, cwd=None):
    """Return a command of khr that has ended."""
    return subprocess.run(
        [python, '-m', 'khr.cli.command', *map(str, arguments)],
        capture_output=True,
        text=True,
        env=environment(),
        cwd=cwd,
        timeout=110,
        check=False,
    )


def khr(python, *arguments, cwd=None):
    done = ended(python, *arguments, cwd=cwd)
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


def test_three_ways_of_running_give_one_trajectory(python, recorded, tmp_path):
    assert run(python, tmp_path / 'offline', SCENARIO, '--offline') == recorded[1]
    graph = run(python, tmp_path / 'graph', SCENARIO, '--one-process', '--no-record')
    assert graph == recorded[1]
    without = run(
        python, tmp_path / 'without', SCENARIO, '--offline', '--set', 'knee_controller.gain=0'
    )
    assert without != recorded[1], 'the knees do nothing'


def test_its_corrections_and_parameters_are_in_the_bag(python, recorded):
    folder, _ = recorded
    sent = [message for _, message in Bag(folder / 'bag')['/knee_controller/correction']]
    assert len(sent) == ceil(SECONDS / 0.015) + 1  # of every instant, the first included
    assert list(sent[0].name) == ['l_knee', 'r_knee']
    assert any(message.position[0] > 0.0 for message in sent)
    assert 'knee_controller' in (folder / 'scenario.yaml').read_text()
    assert khr(python, 'verify', folder).strip().endswith('same')


WHERE_SHOWN = """
import json, sys, khr
from khr_report.run.overview import CORRECTIONS, panes_of
from khr_view.controls import tunables
from khr_view.charts.charts import charts
run = khr.load(sys.argv[1])
lines = [line for pane in panes_of({'': run.signals}, [CORRECTIONS]) for line in pane.lines]
print(json.dumps({
    'signals': list(run.signals.controllers),
    'table': run.table()['correction_knee'].to_pylist(),
    'overview': [name for name, *_ in lines],
    'chart': [line.label for chart in charts() for line in chart.lines],
    'controls': [each.label for each in tunables()],
}))
"""


def test_it_is_in_signals_charts_sliders_and_report(python, recorded):
    folder, _ = recorded
    printed = subprocess.run(
        [python, '-c', WHERE_SHOWN, folder],
        capture_output=True,
        text=True,
        env=environment(),
        check=True,
    ).stdout
    shown = json.loads(printed)
    assert shown['signals'] == ['ankle', 'hip', 'knee']
    sent = [
        message.position[0] for _, message in Bag(folder / 'bag')['/knee_controller/correction']
    ]
    assert shown['table'] == sent
    assert 'knee' in shown['overview'] and 'knee' in shown['chart']
    assert {'Knee control', 'Knee gain'} <= set(shown['controls'])
    khr(python, 'report', folder)
    table = re.search(r'data:text/csv;base64,([\w+/=]+)', (folder / 'report.html').read_text())
    header = next(csv.reader(base64.b64decode(table[1]).decode().splitlines()))
    assert 'correction_knee, deg' in header


def test_its_gain_changes_while_it_runs(python, tmp_path):
    own = [python, '-m', 'khr.cli.command']
    running = subprocess.Popen(
        [*own, 'run', SCENARIO, *LONG, '--no-record', '--out', tmp_path / 'run'],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    try:
        entry = wait_for(lambda: _domain(running.pid), 'the run')
        khr(python, 'set', 'knee_controller', 'gain', '9', '--domain', entry)
        shown = khr(python, 'get', 'knee_controller', 'gain', '--domain', entry)
        assert yaml.safe_load(shown) == {'gain': 9.0}
    finally:
        running.send_signal(signal.SIGINT)
        running.communicate(timeout=60)


def _domain(pid):
    """Return the domain of the run of a process, once it is registered."""
    return next((entry.domain for entry in run_registry.running() if entry.pid == pid), None)


def test_it_can_be_swept(python, tmp_path):
    shutil.copy(SCENARIO, tmp_path)
    (tmp_path / 'sweep.yaml').write_text(
        'scenario: walk_5deg_knee.yaml\nduration: 0.6\ngrid:\n  knee_controller.gain: [0.0, 30.0]\n'
    )
    khr(python, 'sweep', 'sweep.yaml', '--workers', '1', '--out', 'out', cwd=tmp_path)
    request = request_of(read_results(tmp_path / 'out' / 'results.parquet'))
    assert request['axes'] == {'knee_controller.gain': [0.0, 30.0]}


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


def test_three_files_are_enough(python, tmp_path):
    source, site = tmp_path / 'source', tmp_path / 'site'
    source.mkdir()
    (source / 'pyproject.toml').write_text(re.search(r'```toml\n(.*?)```', DOCUMENT, re.S)[1])
    (source / 'tail_controller.py').write_text(TAIL)
    (source / 'nod.yaml').write_text(
        '/**/tail_controller:\n  ros__parameters:\n    enabled: true\n'
        '/**/gait:\n  ros__parameters:\n    motion: walk\n'
    )
    install = ['install', '--quiet', '--no-deps', '--no-build-isolation', '--target', site, source]
    subprocess.run([sys.executable, '-m', 'pip', *map(str, install)], check=True)
    hashes = []
    for way in ('--offline', '--one-process'):
        options = ['--duration', '1.5', '--no-draw', '--out', tmp_path / way.strip('-')]
        done = subprocess.run(
            [python, '-m', 'khr.cli.command', 'run', source / 'nod.yaml', *options, way],
            capture_output=True,
            text=True,
            env=environment() | {'PYTHONPATH': str(site)},
            cwd=tmp_path,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        hashes.append(done.stdout.splitlines()[-1])
    assert hashes[0] == hashes[1]


def test_a_scenario_without_it_is_untouched(python, tmp_path):
    command = ('run', 'walk_0deg', '--duration', 0.3, '--offline', '--out')
    beside = khr(python, *command, tmp_path / 'with').splitlines()[-1]
    assert beside == khr_here(*command, tmp_path / 'here').out.splitlines()[-1]


def test_the_document_shows_the_example_and_its_runs_agree(python, documented, recorded, tmp_path):
    *_, second = documented
    assert '--offline' in second and run(python, tmp_path / 'offline', *second) == recorded[1]
    assert documented[0][-1] == str(EXAMPLE.relative_to(ROOT))
    excerpt = re.search(r'```python\n(.*?)```', DOCUMENT, re.S)[1]
    law = iter((EXAMPLE / 'khr_example_controller' / 'knee.py').read_text().splitlines())
    assert all(line in law for line in excerpt.splitlines() if line), 'not as in knee.py'


def test_an_error_in_its_law_names_file_and_line(python, tmp_path):
    """Keep this test last: it changes the installed controller."""
    found = subprocess.run(
        [python, '-c', 'from khr_example_controller import knee; print(knee.__file__)'],
        capture_output=True,
        text=True,
        check=True,
        env=environment(),
    )
    module = Path(found.stdout.strip())
    good = module.read_text()
    module.write_text(re.sub(r'^( {8})return .*rate.*$', r'\1return nonsense', good, flags=re.M))
    try:
        for way in ('--offline', '--no-record', '--processes'):
            done = ended(python, 'run', SCENARIO, way, '--out', tmp_path / way, cwd=ROOT)
            text = done.stderr
            assert done.returncode == 1 and 'Traceback' not in text, text
            assert re.search(
                r"knee_controller: NameError: name 'nonsense' .*knee\.py, line \d+", text
            )
            if way != '--offline':
                log = Path(re.search(r'more in (\S+\.log)', text)[1]).read_text()
                assert 'return nonsense' in log and 'nodes/block_node.py' not in log
    finally:
        module.write_text(good)
