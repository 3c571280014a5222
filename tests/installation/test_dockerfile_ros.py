"""The steps of Dockerfile.ros, as far as they can be checked without the image of ROS."""

import json
import subprocess

from tests import ROOT

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
