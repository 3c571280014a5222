"""The recipe of docs/ros2.md, line by line, on a machine that has ROS and has never seen khr."""

import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

import pytest

from tests import ROOT
from tests.support.prefixes import check_prefix

pytestmark = [pytest.mark.nightly, pytest.mark.timeout(2400)]
NAMES = sorted(path.parent.name for path in (ROOT / 'src').glob('*/package.xml'))
VENV, ROSDEP, PACKAGES, *LATER = re.search(
    r'```sh\n(python3 -m venv .*?)```', (ROOT / 'docs' / 'ros2.md').read_text(), re.S
)[1].splitlines()
NOT_HERE = 'ros2 '  # a command of the full ROS 2, as rosdep is
# They need much of what pip installs, and not long. The suite runs the tests of all itself.
TESTED = 'khr_common khr_analysis khr_view'
WORKSPACE = ('. venv/bin/activate && . ros2_ws/install/setup.bash',)
LEFT_OUT = shutil.ignore_patterns(
    '.*', '__pycache__', '*.egg-info', 'build', 'install', 'log', 'runs', 'site'
)


class Machine:
    """A checkout in an environment of its own, with Python and what ROS and apt have installed."""

    def __init__(self, folder):
        self.checkout = folder / 'khr'
        shutil.copytree(ROOT, self.checkout, symlinks=True, ignore=LEFT_OUT)
        system, tools = folder / 'site-packages', folder / 'bin'
        system.mkdir()
        tools.mkdir()
        python = Path(sys.executable).resolve()
        (tools / 'python3').symlink_to(python)
        colcon = (Path(sys.prefix) / 'bin' / 'colcon').read_text().splitlines()
        (tools / 'colcon').write_text('\n'.join([f'#!{python}', *colcon[1:]]))
        (tools / 'colcon').chmod(0o755)
        self._environment = {
            'PATH': f'{tools}:/usr/bin:/bin',
            'HOME': str(folder),
            'TMPDIR': str(folder),
            'LANG': 'C.UTF-8',
            # As setup.bash of ROS does.
            'PYTHONPATH': str(system),
            'LD_LIBRARY_PATH': os.environ.get('LD_LIBRARY_PATH', ''),
            'PIP_NO_INDEX': '1',  # what it would fetch is there
        }
        by_pip = named_in(PACKAGES)
        self.run(VENV)
        (venv,) = self.checkout.glob('venv/lib/python3*/site-packages')
        for each in distributions():
            name = normal(each.metadata['Name'])
            if name.split('-')[0] != 'khr':
                link(each, venv if name in by_pip else system)

    def run(self, *lines):
        """Run lines in one shell, as in a terminal; return what they print."""
        ended = subprocess.run(
            ['bash', '-ec', '\n'.join(lines)],
            cwd=self.checkout,
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert ended.returncode == 0, ended.stdout[-10_000:]
        return ended.stdout


def normal(name):
    return re.sub(r'[-_.]+', '-', name).lower()


def named_in(line):
    """Return the distributions that the line for pip installs."""
    listed = (ROOT / 'requirements.in').read_text().splitlines()
    lines = [each for each in listed if each and not each.startswith(('#', 'ros-'))]
    words = line.partition('/dev/stdin ')[2].split()
    return {normal(re.match(r'[\w.-]+', each)[0]) for each in (*lines, *words)}


def link(distribution, folder):
    """Link what a distribution has installed beside its metadata into a folder."""
    for first in {path.parts[0] for path in distribution.files or () if '..' not in path.parts}:
        source, target = Path(str(distribution.locate_file(first))), folder / first
        if first != '__pycache__' and source.exists() and not target.exists():
            target.symlink_to(source)


@pytest.fixture(scope='module')
def machine(tmp_path_factory):
    """A machine on which the recipe has been followed, but for what needs all of ROS."""
    found = Machine(tmp_path_factory.mktemp('machine'))
    lines = [line for line in (PACKAGES, *LATER) if not line.startswith(NOT_HERE)]
    *before, built = lines
    some = built.replace('$colcon test ', f'$colcon test --packages-select {TESTED} ')
    assert some != built
    found.printed = found.run('. venv/bin/activate', *before, some)
    return found


def test_all_packages_are_built_and_their_unit_tests_pass(machine):
    counted = re.search(r'Summary: (\d+) tests, 0 errors, 0 failures', machine.printed)
    assert int(counted[1]) > 200
    for name in NAMES:
        check_prefix(machine.checkout / 'ros2_ws' / 'install' / name, name)


def test_command_and_nodes_run_from_the_workspace_with_portable_arithmetic(machine):
    install = machine.checkout / 'ros2_ws' / 'install'
    printed = machine.run(*WORKSPACE, 'python3 -c "import khr; print(khr.__file__)"')
    assert printed.startswith(str(install))
    gait = 'ros2_ws/install/khr_balance/lib/khr_balance/gait --ros-args -p motion:=run'
    assert 'accepted: stand | ' in machine.run(*WORKSPACE, f'{gait} || test $? = 2')
    hooks = (install / 'khr_common/share/khr_common/package.dsv').read_text()
    assert 'source;share/khr_common/hook/arithmetic.dsv' in hooks
