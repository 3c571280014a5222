"""What a ROS 2 user finds: ament index, executables, shares; from pip and from colcon."""

import configparser
import json
import os
import subprocess
import sys
from importlib.metadata import metadata, version
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tests import ROOT
from tests.support.prefixes import check_prefix

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


def test_ros2_users_find_no_launch_import_outside_launch_files():
    for path in (ROOT / 'src').rglob('*.py'):
        if path.parent.name != 'launch':
            assert 'from launch' not in path.read_text(), path


LINES = (ROOT / 'Dockerfile.ros').read_text(encoding='utf-8').splitlines()
STEPS = [line.partition(' ')[::2] for line in LINES if line and not line.startswith('#')]


def test_its_instructions_are_of_docker_and_its_shell_is_valid():
    assert {name for name, _ in STEPS} == {'FROM', 'RUN', 'WORKDIR', 'COPY', 'ENTRYPOINT', 'CMD'}
    for name, text in STEPS:
        if name == 'RUN':
            subprocess.run(['sh', '-n', '-c', text], check=True)
        if name in ('ENTRYPOINT', 'CMD'):
            assert all(isinstance(each, str) for each in json.loads(text))
    entry = json.loads(dict(STEPS)['ENTRYPOINT'])
    subprocess.run(['bash', '-n', '-c', entry[2]], check=True)


def test_what_it_copies_is_there_and_sent_to_docker():
    allowed = (ROOT / '.dockerignore').read_text().splitlines()
    copied = [each for name, text in STEPS if name == 'COPY' for each in text.split()[:-1]]
    assert copied == ['requirements.in', 'LICENSE', 'config', 'src', 'ros2_ws']
    for source in copied:
        assert (ROOT / source).exists() and f'!{source}' in allowed
    assert (ROOT / 'ros2_ws/src').resolve() == ROOT / 'src'


def test_what_it_starts_is_installed():
    _, _, package, launch = json.loads(dict(STEPS)['CMD'])
    assert (ROOT / 'src' / package / 'launch' / launch).is_file()
    assert (ROOT / 'config/scenarios/walk_8.88deg_ka18.yaml').is_file()


def test_pip_installs_nothing_of_ros():
    (text,) = (text for name, text in STEPS if name == 'RUN' and 'requirements.in' in text)
    command = text.partition(' | ')[0]
    left = subprocess.run(['sh', '-c', command], check=True, cwd=ROOT, capture_output=True)
    names = left.stdout.decode().split()
    assert 'mujoco' in left.stdout.decode() and not any(name.startswith('ros-') for name in names)
