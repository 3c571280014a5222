"""What a ROS 2 user finds: ament index, executables, shares; from pip and from colcon."""

import configparser
import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import metadata, version
from pathlib import Path
from xml.etree import ElementTree

import pytest

from khr_bringup.node_registry import registry
from tests import ROOT

NAMES = sorted(path.parent.name for path in (ROOT / 'src').glob('*/package.xml'))
TESTED = [name for name in NAMES if (ROOT / 'tests' / 'unit' / name).is_dir()]


def environment(**extra):
    """Return an environment without what pytest or this checkout put on the path."""
    kept = {
        key: value
        for key, value in os.environ.items()
        if key not in ('PYTHONPATH', 'LD_LIBRARY_PATH', '_ROS_WHEELS_BOOTSTRAP_COMPLETE')
    }
    return {**kept, 'PATH': f'{Path(sys.executable).parent}:{kept["PATH"]}', **extra}


def check_prefix(prefix, name):
    assert (prefix / 'share' / 'ament_index' / 'resource_index' / 'packages' / name).is_file()
    assert (prefix / 'share' / name / 'package.xml').is_file()
    for node, registered in registry().items():
        executable = prefix / 'lib' / registered.spec.package / node
        if registered.spec.package == name:
            assert os.access(executable, os.X_OK), executable
    if name == 'khr_bringup':
        assert (prefix / 'share' / name / 'launch' / 'balance.launch.py').is_file()
        config = prefix / 'share' / name / 'config'
        assert (config / 'scenarios' / 'walk_7.68deg_ka12.yaml').is_file()
        assert (config / 'view' / 'khr.rviz').is_file()
    if name == 'khr_sim':
        assert (prefix / 'share' / name / 'urdf' / 'khr3hv.urdf').is_file()


@pytest.mark.parametrize('name', NAMES)
def test_manifest_is_format_3_and_agrees_with_setup(name):
    manifest = ElementTree.parse(ROOT / 'src' / name / 'package.xml').getroot()
    assert manifest.get('format') == '3'
    assert manifest.findtext('name') == name
    assert manifest.findtext('license') == 'Apache-2.0'
    assert manifest.findtext('export/build_type') == 'ament_python'
    assert manifest.findtext('version') == version(name)


@pytest.mark.parametrize('name', NAMES)
def test_manifest_says_where_licence_and_home_are(name):
    folder = ROOT / 'src' / name
    manifest = ElementTree.parse(folder / 'package.xml').getroot()
    licence = folder / manifest.find('license').get('file')
    assert licence.read_text() == (ROOT / 'LICENSE').read_text()
    assert manifest.find('url').get('type') == 'website'
    (home,) = metadata(name).get_all('Home-page')
    assert home == manifest.findtext('url')
    released = re.search(
        r'^(\S+) \(\d{4}-\d\d-\d\d\)$', (folder / 'CHANGELOG.rst').read_text(), re.M
    )
    assert released[1] == manifest.findtext('version')


def test_fields_that_wait_for_the_owner_are_named_in_contributing():
    """As long as they hold an address that cannot be one."""
    text = (ROOT / 'CONTRIBUTING.md').read_text()
    manifest = ElementTree.parse(ROOT / 'src/khr_common/package.xml').getroot()
    for value in (manifest.find('maintainer').get('email'), manifest.findtext('url')):
        if value.endswith('.invalid'):
            assert value in text


@pytest.mark.parametrize('name', TESTED)
def test_colcon_finds_the_unit_tests_of_a_package(name):
    """One copy of them serves both: those of the top-level folder."""
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'src' / name / 'setup.cfg')
    own = settings['tool:pytest']
    places = [(ROOT / 'src' / name / place).resolve() for place in own['testpaths'].split()]
    assert places == [ROOT / 'tests' / 'unit' / name]
    assert list(places[0].rglob('test_*.py'))
    assert (ROOT / 'src' / name / own['pythonpath']).resolve() == ROOT


@pytest.mark.parametrize('name', NAMES)
def test_pip_environment_has_the_ament_entries(name):
    prefix = Path(sys.prefix)
    check_prefix(prefix, name)


def test_index_finds_the_packages_of_the_pip_environment():
    code = (
        'from ament_index_python.packages import get_package_share_directory as share;'
        f'print([share(name) for name in {NAMES}])'
    )
    result = subprocess.run(
        [sys.executable, '-c', code],
        capture_output=True,
        text=True,
        env=environment(AMENT_PREFIX_PATH=sys.prefix),
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert str(Path(sys.prefix) / 'share' / 'khr_sim') in result.stdout


def test_colcon_builds_and_a_node_runs_from_the_overlay(tmp_path):
    for name in NAMES:  # a copy, so that a build of the checkout is left alone
        shutil.copytree(
            ROOT / 'src' / name,
            tmp_path / 'src' / name,
            symlinks=False,
            ignore=shutil.ignore_patterns('build', '*.egg-info', '__pycache__'),
        )
    built = subprocess.run(
        ['colcon', 'build', '--event-handlers', 'console_direct+'],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert built.returncode == 0, built.stdout + built.stderr
    for name in NAMES:
        check_prefix(tmp_path / 'install' / name, name)
    gait = subprocess.run(
        [
            'bash',
            '-c',
            '. install/setup.bash && timeout -s INT 90 install/khr_balance/lib/'
            'khr_balance/gait --ros-args -p motion:=run',
        ],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert gait.returncode == 2
    assert 'stand | walk | leg_lift' in gait.stderr
    where = subprocess.run(
        [
            'bash',
            '-c',
            '. install/setup.bash && python3 -c "import khr_balance; print(khr_balance.__file__)"',
        ],
        cwd=tmp_path,
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert str(tmp_path / 'install') in where.stdout, where.stderr
    check_colcon_test(tmp_path)


def check_colcon_test(workspace):
    """One package stands for all: its tests run, and their number is known."""
    skipped = shutil.ignore_patterns('__pycache__')
    shutil.copytree(ROOT / 'tests', workspace / 'tests', ignore=skipped)
    for command in (['test', '--packages-select', 'khr_common'], ['test-result', '--verbose']):
        ended = subprocess.run(
            ['colcon', *command],
            cwd=workspace,
            env=environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert ended.returncode == 0, ended.stdout + ended.stderr
    counted = re.search(r'Summary: (\d+) tests, 0 errors, 0 failures', ended.stdout)
    assert int(counted[1]) > 100


def test_ros2_users_find_no_launch_import_outside_launch_files():
    for path in (ROOT / 'src').rglob('*.py'):
        if path.parent.name != 'launch':
            assert 'from launch' not in path.read_text(), path
