"""Distributions, of every package and of the whole, hold all; the image of the whole runs alone."""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from configparser import ConfigParser
from pathlib import Path

import pytest

from tests import ROOT

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]
PARTS = sorted(path.parent.name for path in (ROOT / 'src').glob('*/package.xml'))
PIP = [sys.executable, '-m', 'pip', '--quiet', '--disable-pip-version-check']
BUILD = [*PIP, 'wheel', '--no-deps', '--no-build-isolation', '--no-index']
NO_SOURCES = shutil.ignore_patterns('build', '*.egg-info', '__pycache__')


def run(*command, **options):
    ended = subprocess.run(
        [*map(str, command)], capture_output=True, text=True, check=False, **options
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    return ended.stdout


def copy(name, target):
    """Copy a file or folder of the repository into a folder, or as that folder."""
    if (ROOT / name).is_dir():
        shutil.copytree(ROOT / name, target, symlinks=True, ignore=NO_SOURCES)
    else:
        shutil.copy(ROOT / name, target)


def modules(wheels):
    """Return the files that are imported or read beside what is, from some wheels."""
    names = [name for wheel in wheels for name in zipfile.ZipFile(wheel).namelist()]
    return {name for name in names if '.dist-info/' not in name and '.data/' not in name}


def entries(wheels):
    """Return the entry points of some wheels by group."""
    found = {}
    for wheel in wheels:
        with zipfile.ZipFile(wheel) as file:
            for name in file.namelist():
                if name.endswith('.dist-info/entry_points.txt'):
                    given = ConfigParser()
                    given.read_string(file.read(name).decode())
                    for group in given.sections():
                        found.setdefault(group, {}).update(given[group])
    return found


@pytest.mark.nightly
def test_the_whole_is_its_parts_and_the_sdist_makes_the_same_wheel(tmp_path):
    """All are built from a copy of the sources: building leaves files there."""
    for name in ('src', 'config', '.ci'):
        copy(name, tmp_path / name)
    for name in ('pyproject.toml', 'setup.py', 'requirements.in', 'README.md', 'LICENSE'):
        copy(name, tmp_path)
    copy('MANIFEST.in', tmp_path)
    printed = run(sys.executable, '.ci/dist', 'dist', cwd=tmp_path)
    sdist, whole = map(Path, printed.split())
    assert sorted((tmp_path / 'dist').iterdir()) == sorted([sdist, whole])
    run(*BUILD, '-w', 'parts', *(f'./src/{name}' for name in PARTS), cwd=tmp_path)
    parts = sorted((tmp_path / 'parts').iterdir())
    assert [wheel.name.split('-')[0] for wheel in parts] == PARTS
    assert modules([whole]) == modules(parts) and entries([whole]) == entries(parts)
    templates = {path.relative_to(path.parents[2]) for path in ROOT.glob('src/*/*/*/*.j2')}
    assert len(templates) > 5 and {*map(str, templates)} <= modules(parts)
    run(*BUILD, '-w', 'again', sdist, cwd=tmp_path)
    assert modules((tmp_path / 'again').iterdir()) == modules(parts)


def bare(folder):
    """Make an environment with all that this one has, but for the project itself."""
    run(sys.executable, '-m', 'venv', '--without-pip', folder)
    paths = sysconfig.get_paths(vars={'base': str(folder), 'platbase': str(folder)})
    for entry in Path(sysconfig.get_paths()['purelib']).iterdir():
        if not entry.name.startswith(('khr', '__pycache__')):
            (Path(paths['purelib']) / entry.name).symlink_to(entry)
    return folder / 'bin'


def options_for(bin_folder, folder):
    """Return where a command runs: in an environment of its own, without the network."""
    kept = {key: value for key, value in os.environ.items() if key != 'PYTHONPATH'}
    own = {'PATH': f'{bin_folder}:{kept["PATH"]}', 'PIP_NO_INDEX': '1', 'PIP_NO_CACHE_DIR': '1'}
    return {'cwd': folder, 'env': kept | own | {'PIP_DISABLE_PIP_VERSION_CHECK': '1'}}


@pytest.mark.nightly
def test_the_steps_of_the_dockerfile_lead_to_a_run(tmp_path):
    """Done here in a folder, with this environment's packages for those of the base image."""
    bin_folder, image = bare(tmp_path / 'venv'), tmp_path / 'image'
    pip = bin_folder / 'pip'
    pip.write_text(f'#!/bin/sh\nexec {bin_folder}/python -m pip "$@"\n')
    pip.chmod(0o755)
    image.mkdir()
    allowed = (ROOT / '.dockerignore').read_text().splitlines()
    lines = (ROOT / 'Dockerfile').read_text().splitlines()
    others = []
    for line in lines:
        name, _, text = line.partition(' ')
        if name == 'COPY':
            *sources, target = text.split()
            for source in sources:
                assert f'!{source}' in allowed
                copy(source, image / target)
        elif name == 'RUN' and text.startswith('pip '):
            run('sh', '-c', text, **options_for(bin_folder, image))
        elif name not in ('', '#'):
            others.append(name)
    assert others == ['FROM', 'WORKDIR', 'RUN', 'USER', 'WORKDIR', 'ENTRYPOINT', 'CMD']
    shutil.rmtree(image)  # what runs must not need the sources
    options = options_for(bin_folder, tmp_path)
    where = run(bin_folder / 'python', '-c', 'import khr; print(khr.__file__)', **options)
    assert where.startswith(str(bin_folder.parent))
    short = ['run', 'walk_3deg', '--duration', '0.3', '--out', tmp_path / 'run', '--no-record']
    assert 'trajectory hash' in run(bin_folder / 'khr', *short, **options)


@pytest.mark.nightly
def test_docker_builds_the_image():
    if not shutil.which('docker') or subprocess.run(['docker', 'info'], check=False,
                                                    capture_output=True).returncode:  # fmt: skip
        pytest.skip('no Docker here: the steps of the Dockerfile are tried without it')
    run('docker', 'build', '--tag', 'khr-tested', ROOT)
    assert 'walk_3deg' in run('docker', 'run', '--rm', 'khr-tested')
