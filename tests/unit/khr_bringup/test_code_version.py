"""Tests of the version of the code that a trajectory comes from."""

import pytest

from khr_bringup import code_version


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
