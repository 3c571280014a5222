"""Each package declares what it imports, for pip and rosdep, and what is fetched is pinned."""

import ast
import re
import sys
import tomllib
from xml.etree import ElementTree

import pytest

from tests import ROOT

PACKAGES = sorted((ROOT / 'src').glob('khr*'))
WHOLE = tomllib.loads((ROOT / 'pyproject.toml').read_text(encoding='utf-8'))
ROS = {
    'ament_index_python',
    'builtin_interfaces',
    'diagnostic_msgs',
    'geometry_msgs',
    'launch',
    'launch_ros',
    'nav_msgs',
    'rcl_interfaces',
    'rclpy',
    'rosgraph_msgs',
    'sensor_msgs',
    'std_msgs',
    'std_srvs',
    'tf2_msgs',
}
PIP_NAMES = {
    'PIL': 'pillow',
    'imageio_ffmpeg': 'imageio-ffmpeg',
    'markdown_it': 'markdown-it-py',
    'pydantic_core': 'pydantic',  # which brings it
    'serial': 'pyserial',
    'yaml': 'pyyaml',
}
ROSDEP_KEYS = {  # in rosdep/python.yaml of rosdistro
    'jinja2': 'python3-jinja2',
    'llvmlite': 'python3-numba',  # which brings it
    'markdown-it-py': 'python3-rich',  # which depends on it
    'markupsafe': 'python3-jinja2',  # which brings it
    'matplotlib': 'python3-matplotlib',
    'numba': 'python3-numba',
    'numpy': 'python3-numpy',
    'pandas': 'python3-pandas',
    'pillow': 'python3-pil',
    'psutil': 'python3-psutil',
    'pybullet': 'python3-pybullet-pip',
    'pydantic': 'python3-pydantic',
    'pyserial': 'python3-serial',
    'pyyaml': 'python3-yaml',
    'rich': 'python3-rich',
    'rosbags': 'python3-rosbags-pip',
    'scipy': 'python3-scipy',
    'typer': 'python3-typer',
    'websockets': 'python3-websockets',
}
OF_LAUNCH = {'robot_state_publisher', 'ros2launch'}  # what a launch file needs, imported or not
WINDOWS = {'khr_description': {'joint_state_publisher_gui', 'rviz2'}}  # of its launch file
OPTIONAL = {'mujoco', 'pettingzoo'}  # extras of pip's, imported if they are asked for


def imported(folder):
    """Return the top-level modules that a package imports, and those of the messages it names."""
    names = set()
    for path in (
        each for part in (folder.name, 'launch') for each in (folder / part).rglob('*.py')
    ):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(node.module.split('.')[0])
            elif isinstance(node, ast.Constant):
                message = re.fullmatch(r'(\w+)/(msg|srv)/\w+', str(node.value))
                names |= {message[1]} if message else set()
    return names - set(sys.stdlib_module_names) - {folder.name}


def plain(requirement):
    """Return the name of a requirement, without its version and extras."""
    return re.match(r'[\w-]+', requirement)[0].lower()


def from_pip(modules):
    """Return the names under which pip knows modules."""
    return {PIP_NAMES.get(name, name) for name in modules - ROS}


def declared_for_pip(folder):
    """Return the requirements of a setup.py, and those of its extras."""
    (call,) = (
        node.value
        for node in ast.parse((folder / 'setup.py').read_text(encoding='utf-8')).body
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    )
    values = {word.arg: word.value for word in call.keywords}
    extras = ast.literal_eval(values['extras_require'])
    return {plain(name) for name in ast.literal_eval(values['install_requires'])}, extras


def manifest(folder):
    return (folder / 'package.xml').read_text(encoding='utf-8')


@pytest.mark.parametrize('folder', PACKAGES, ids=lambda folder: folder.name)
def test_setup_and_manifest_declare_what_is_imported(folder):
    """What rosdep does not know is named in a comment, so that a reader misses nothing."""
    modules, text = imported(folder), manifest(folder)
    required, extras = declared_for_pip(folder)
    needed = from_pip(modules) - OPTIONAL
    assert required == needed
    assert from_pip(modules) - needed <= {plain(name) for some in extras.values() for name in some}
    ours = {name for name in needed if name.startswith('khr_')}
    keys = {ROSDEP_KEYS[name] for name in needed if name in ROSDEP_KEYS}
    depends = sorted(each.text for each in ElementTree.fromstring(text).iter('exec_depend'))
    started = OF_LAUNCH if (folder / 'launch').is_dir() else set()
    windows = WINDOWS.get(folder.name, set())
    assert depends == sorted((modules & ROS) | ours | keys | started | windows)
    comment = re.search(r'<!-- by pip alone: (.*) -->', text)
    assert set(comment[1].split(', ') if comment else []) == needed - ours - set(ROSDEP_KEYS)


def test_requirements_are_those_that_the_packages_declare():
    """The runtime list holds no more, but for ROS itself."""
    lines = (ROOT / 'requirements.in').read_text(encoding='utf-8').splitlines()
    listed = {plain(line) for line in lines if line and not line.startswith('#')}
    declared = set()
    for folder in PACKAGES:
        required, extras = declared_for_pip(folder)
        extra = {plain(name) for each, some in extras.items() if each != 'test' for name in some}
        declared |= required | extra
    assert listed == {name for name in declared if not name.startswith('khr_')}


@pytest.mark.parametrize('name', ['requirements', 'requirements-dev'])
def test_every_requirement_is_pinned(name):
    asked = (ROOT / f'{name}.in').read_text(encoding='utf-8')
    if name == 'requirements':  # and what builds the packages
        asked += '\n'.join(['', *WHOLE['build-system']['requires']])
    pinned = (ROOT / f'{name}.lock').read_text(encoding='utf-8')
    names = {plain(line) for line in asked.splitlines() if re.match('[a-z]', line)}
    pins = re.findall(r'^([\w.-]+)==', pinned, re.MULTILINE)
    assert names <= set(pins)
    assert len(pins) == len(re.findall(r'^[a-z]', pinned, re.MULTILINE))


def test_there_is_one_version():
    versions = {ElementTree.fromstring(manifest(each)).findtext('version') for each in PACKAGES}
    log = (ROOT / 'CHANGELOG.md').read_text(encoding='utf-8')
    newest = re.search(r'^## \[(\d+\.\d+\.\d+)\]', log, re.MULTILINE)
    assert versions == {newest[1]} == {WHOLE['project']['version']}


@pytest.mark.parametrize('name', ['Makefile', 'Dockerfile', '.ci/install'])
def test_what_is_fetched_is_fetched_by_its_digest(name):
    fetches = r'^(?:\t|RUN | +command = ).*(?:pip install|\$\(INSTALL\)|PIP, .install.).*$'
    found = re.findall(fetches, (ROOT / name).read_text(), re.MULTILINE)
    assert any('--require-hashes' in line for line in found)
    for line in found:  # what is built of these sources has none; arguments are the Makefile's
        assert '--require-hashes' in line or '--no-deps' in line or 'sys.argv' in line, line
