"""The registry: this project's nodes, and foreign ones that do not fit in."""

import os
import subprocess
import sys

import pytest

from khr_analysis.recorder_parameters import OF_EVERY_RUN
from khr_bringup.code_version import version_in, version_of
from khr_bringup.node_registry import node_of, registry, table_of
from khr_bringup.scenario.scenario import load_scenario
from khr_common.errors import KhrError
from khr_common.interfaces import REGIONS

GOOD = """
from dataclasses import dataclass

from khr_common import parameter
from khr_common.block import Block, NodeSpec
from khr_common.interfaces import FOOT_FORCES, GYRO, Topic, correction


@dataclass(frozen=True)
class Table:
    gain: float = parameter(1.0, 'Gain.')


class Foreign(Block):
    subscribes = (GYRO,)
    publishes = (correction('foreign', ('l_knee',)),)

    def update(self, time, signals):
        return ((0.0,),)


SPEC = NodeSpec('foreign', 'foreign', Table, Foreign)
"""


def install(folder, module, entry='foreign = foreign:SPEC'):
    """Put a foreign package of one module that has one entry point into a folder."""
    (folder / 'foreign.py').write_text(module)
    information = folder / 'foreign-1.0.dist-info'
    information.mkdir()
    (information / 'METADATA').write_text('Metadata-Version: 2.1\nName: foreign\nVersion: 1.0\n')
    (information / 'entry_points.txt').write_text(f'[khr.nodes]\n{entry}\n')


def khr(folder, *arguments):
    """Run khr where the packages of a folder are installed too."""
    return subprocess.run(
        [sys.executable, '-m', 'khr.cli.command', *map(str, arguments)],
        capture_output=True,
        text=True,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join([str(folder), *sys.path])},
        check=False,
    )


@pytest.fixture
def registry_with(tmp_path, monkeypatch):
    """Read the registry where a foreign package is installed too."""

    def read(module, entry):
        install(tmp_path, module, entry)
        return registry.__wrapped__()

    monkeypatch.syspath_prepend(tmp_path)
    yield read
    sys.modules.pop('foreign', None)


def test_one_that_does_not_is_one_line_of_the_command(tmp_path):
    install(tmp_path, 'SPEC = 1')
    done = khr(tmp_path, 'scenarios')
    assert (done.returncode, done.stdout) == (2, '')
    assert done.stderr.startswith('khr: foreign: ') and done.stderr.count('\n') == 1


@pytest.mark.slow
def test_a_node_of_one_module_takes_part_in_runs_and_in_their_code_version(tmp_path):
    codes = []
    for name, module in (('one', GOOD), ('two', GOOD + '# changed')):
        (tmp_path / name).mkdir()
        run = ['run', 'stand_0deg', '--offline', '--duration', 0.1, '--out', tmp_path / name / 'x']
        install(tmp_path / name, module)
        done = khr(tmp_path / name, *run)
        assert done.returncode == 0, done.stderr
        codes.append(version_in((tmp_path / name / 'x' / 'scenario.yaml').read_text()))
    assert len({*codes, version_of(load_scenario('stand_0deg'))}) == 3


@pytest.mark.parametrize(
    ('module', 'entry', 'says'),
    [
        ('import nothing_of_this_name', 'foreign = foreign:SPEC', ['ModuleNotFoundError']),
        (GOOD, 'foreign = foreign:MISSING', ['AttributeError', 'MISSING']),
        ('SPEC = 1', 'foreign = foreign:SPEC', ['1 is not accepted', 'a NodeSpec']),
        (GOOD, 'another = foreign:SPEC', ['its entry point is called another']),
        (
            GOOD.replace("'foreign', 'foreign'", "'gyro', 'foreign'"),
            'gyro = foreign:SPEC',
            ['node gyro', 'has a node of this name'],
        ),
        (
            GOOD.replace("(correction('foreign', ('l_knee',)),)", 'FOOT_FORCES'),
            'foreign = foreign:SPEC',
            ['topic foot_force/left_toe', 'no node publishes yet'],
        ),
        (
            GOOD.replace('Table, Foreign)', 'None, Foreign)'),
            'foreign = foreign:SPEC',
            ['table None is not accepted', 'a dataclass of parameters'],
        ),
        (
            GOOD.replace("parameter(1.0, 'Gain.')", '1.0'),
            'foreign = foreign:SPEC',
            ['table Table is not accepted', 'khr_common.parameter'],
        ),
    ],
)
def test_one_that_does_not_is_refused_and_its_package_named(registry_with, module, entry, says):
    with pytest.raises(KhrError) as refusal:
        registry_with(module, entry)
    assert str(refusal.value).startswith('foreign: ')
    assert '\n' not in str(refusal.value)
    for word in says:
        assert word in str(refusal.value)


def test_what_a_node_publishes_itself_is_no_circle(registry_with):
    loop = "Topic('loop', GYRO.kind, '')"
    module = GOOD.replace('(GYRO,)', f"(correction('foreign', ()), {loop})")
    module = module.replace("('l_knee',)),)", f"('l_knee',)), {loop})")
    assert 'foreign' in registry_with(module, 'foreign = foreign:SPEC')


def test_nodes_are_in_the_order_in_which_data_flows():
    names = list(registry())
    assert names[0] == 'simulator' and names[-2:] == ['recorder', 'recovery']
    for before, after in (
        ('gyro', 'hip_controller'),
        ('foot_force', 'stage'),
        ('stage', 'ankle_controller'),
    ):
        assert names.index(before) < names.index(after)


def test_the_nodes_of_this_project_are_its_own():
    assert all(node.own for node in registry().values())


def test_tables_and_names_find_each_other():
    assert all(node_of(table_of(name)) == name for name in registry())


def test_every_topic_of_a_run_has_an_owner_or_is_the_user_s():
    published = {topic for node in registry().values() for topic in node.spec.publishes}
    assert {topic.name for topic in set(OF_EVERY_RUN) - published} == {'push', '/rosout'}


def test_every_region_of_the_feet_has_a_true_force_and_a_sensor():
    names = {topic.name for topic in OF_EVERY_RUN}
    for region in REGIONS:
        assert {f'ground_truth/contact/{region}', f'foot_force/{region}'} <= names
