"""The registry of nodes, foreign ones that do not fit in, and the version of the code of all."""

import sys
from pathlib import Path

import pytest

from khr_analysis.recorder_parameters import OF_EVERY_RUN
from khr_bringup import code_version
from khr_bringup.node_registry import registry
from khr_common.errors import KhrError

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
ENTRY = 'foreign = foreign:SPEC'


@pytest.fixture
def registry_with(tmp_path, monkeypatch):
    """Read the registry where a foreign package, of one module with an entry point, is too."""

    def read(module, entry):
        (tmp_path / 'foreign.py').write_text(module)
        about = tmp_path / 'foreign-1.0.dist-info'
        about.mkdir()
        (about / 'METADATA').write_text('Metadata-Version: 2.1\nName: foreign\nVersion: 1.0\n')
        (about / 'entry_points.txt').write_text(f'[khr.nodes]\n{entry}\n')
        return registry.__wrapped__()

    monkeypatch.syspath_prepend(tmp_path)
    yield read
    sys.modules.pop('foreign', None)


def test_a_node_of_one_module_is_in_the_code_version(registry_with, monkeypatch):
    versions = [code_version.code_version.__wrapped__()]
    found = registry_with(GOOD, ENTRY)
    monkeypatch.setattr(code_version, 'registry', lambda: found)
    for text in (GOOD, GOOD + '# changed'):
        Path(sys.modules['foreign'].__file__).write_text(text)
        versions.append(code_version.code_version.__wrapped__())
    assert len(set(versions)) == 3


@pytest.mark.parametrize(
    ('module', 'entry', 'says'),
    [
        (GOOD, 'foreign = foreign:MISSING', ['AttributeError', 'MISSING']),
        ('SPEC = 1', ENTRY, ['1 is not accepted', 'a NodeSpec']),
        (GOOD, 'another = foreign:SPEC', ['its entry point is called another']),
        (
            GOOD.replace("'foreign', 'foreign'", "'gyro', 'foreign'"),
            'gyro = foreign:SPEC',
            ['node gyro', 'has a node of this name'],
        ),
        (
            GOOD.replace("(correction('foreign', ('l_knee',)),)", 'FOOT_FORCES'),
            ENTRY,
            ['topic foot_force/left_toe', 'no node publishes yet'],
        ),
        (
            GOOD.replace('Table, Foreign)', 'None, Foreign)'),
            ENTRY,
            ['table None is not accepted', 'a dataclass of parameters'],
        ),
        (
            GOOD.replace("parameter(1.0, 'Gain.')", '1.0'),
            ENTRY,
            ['table Table is not accepted', 'khr_common.parameter'],
        ),
    ],
)
def test_a_node_that_does_not_fit_is_refused_and_its_package_named(
    registry_with, module, entry, says
):
    with pytest.raises(KhrError) as refusal:
        registry_with(module, entry)
    assert str(refusal.value).startswith('foreign: ')
    assert '\n' not in str(refusal.value)
    for word in says:
        assert word in str(refusal.value)


def test_a_node_that_subscribes_to_its_own_topic_is_no_circle(registry_with):
    loop = "Topic('loop', GYRO.kind, '')"
    module = GOOD.replace('(GYRO,)', f"(correction('foreign', ()), {loop})")
    module = module.replace("('l_knee',)),)", f"('l_knee',)), {loop})")
    assert 'foreign' in registry_with(module, ENTRY)


def test_every_topic_of_a_run_has_an_owner_or_is_the_user_s():
    published = {topic for node in registry().values() for topic in node.spec.publishes}
    assert {topic.name for topic in set(OF_EVERY_RUN) - published} == {'push', '/rosout'}


def test_version_changes_with_the_code_and_not_with_its_place_or_its_nodes(tmp_path, monkeypatch):
    for name in 'abcd':
        (tmp_path / name / 'nodes').mkdir(parents=True)
        (tmp_path / name / 'x.py').write_text('1' if name != 'c' else '2')
        (tmp_path / name / 'nodes' / 'y.py').write_text(name)
        urdf = tmp_path / name / 'urdf' if name == 'a' else tmp_path / f'urdf of {name}'
        urdf.mkdir()
        (urdf / 'robot.urdf').write_text('1' if name != 'd' else '2')
        if name != 'a':  # as in the source tree
            (tmp_path / name / 'urdf').symlink_to(urdf)
    digests = []
    for name in 'abcd':
        monkeypatch.setattr(code_version, 'files', lambda _, name=name: tmp_path / name)
        digests.append(code_version.code_version.__wrapped__())
    assert digests[0] == digests[1]
    assert len(set(digests)) == 3, 'code and description of the robot both count'


@pytest.mark.parametrize('source', code_version.SOURCES, ids='/'.join)
def test_every_source_of_a_trajectory_is_there(source):
    assert list(code_version._sources(*source))
