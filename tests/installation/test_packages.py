"""What a ROS 2 user finds: manifests, ament index, executables, shares, and an image of ROS."""

import configparser
import json
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


@pytest.mark.parametrize('name', NAMES)
def test_a_manifest_agrees_with_setup_and_licence(name):
    folder = ROOT / 'src' / name
    manifest = ElementTree.parse(folder / 'package.xml').getroot()
    assert manifest.get('format') == '3' and manifest.findtext('name') == name
    assert manifest.findtext('export/build_type') == 'ament_python'
    assert manifest.findtext('version') == version(name)
    assert metadata(name).get_all('Home-page') == [manifest.findtext('url')]
    licence = folder / manifest.find('license').get('file')
    assert licence.read_text() == (ROOT / 'LICENSE').read_text()


@pytest.mark.parametrize('name', TESTED)
def test_colcon_finds_the_unit_tests_of_a_package(name):
    """One copy of them serves both: those of the top-level folder."""
    settings = configparser.ConfigParser()
    settings.read(ROOT / 'src' / name / 'setup.cfg')
    own = settings['tool:pytest']
    places = [(ROOT / 'src' / name / place).resolve() for place in own['testpaths'].split()]
    assert places == [ROOT / 'tests' / 'unit' / name]
    assert (ROOT / 'src' / name / own['pythonpath']).resolve() == ROOT


@pytest.mark.parametrize('name', NAMES)
def test_pip_environment_has_the_ament_entries(name):
    check_prefix(Path(sys.prefix), name)


def test_the_image_of_ros_copies_and_starts_what_there_is():
    lines = (ROOT / 'Dockerfile.ros').read_text(encoding='utf-8').splitlines()
    steps = [line.partition(' ')[::2] for line in lines if line and not line.startswith('#')]
    assert {name for name, _ in steps} == {'FROM', 'RUN', 'WORKDIR', 'COPY', 'ENTRYPOINT', 'CMD'}
    for name, text in steps:
        if name == 'RUN':
            subprocess.run(['sh', '-n', '-c', text], check=True)
    entry = json.loads(dict(steps)['ENTRYPOINT'])
    subprocess.run(['bash', '-n', '-c', entry[2]], check=True)
    allowed = (ROOT / '.dockerignore').read_text().splitlines()
    copied = [each for name, text in steps if name == 'COPY' for each in text.split()[:-1]]
    assert copied == ['requirements.in', 'LICENSE', 'config', 'src', 'ros2_ws']
    for source in copied:
        assert (ROOT / source).exists() and f'!{source}' in allowed
    assert (ROOT / 'ros2_ws/src').resolve() == ROOT / 'src'
    _, _, package, launch = json.loads(dict(steps)['CMD'])
    assert (ROOT / 'src' / package / 'launch' / launch).is_file()
