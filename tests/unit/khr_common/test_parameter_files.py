"""What parameter files say to a node: nothing that is meant for it is lost without a word."""

import pytest

from khr_common import ParameterError
from khr_common.parameter_files import ParameterBlock, check_blocks, files_in, read_blocks

KNOWN = frozenset({'gain', 'limit_deg'})


def check(tmp_path, text, node):
    file = tmp_path / 'file.yaml'
    file.write_text(text)
    return check_blocks(read_blocks(str(file)), node, KNOWN)


@pytest.mark.parametrize(
    ('nodes', 'node', 'holds'),
    [
        ('/gait', '/gait', True),
        ('/**/gait', '/gait', True),
        ('/**/gait', '/a/b/gait', True),
        ('/*/gait', '/a/gait', True),
        ('/*/gait', '/gait', False),
        ('/a/**', '/b/gait', False),
        ('/ga.t', '/gait', False),
    ],
)
def test_wildcards_are_those_of_ros(nodes, node, holds):
    assert ParameterBlock('', nodes, KNOWN).holds_for(node) is holds


@pytest.mark.parametrize(
    'text',
    [
        'gait: {ros__parameters: {gain: 1.0}}',
        '/**/gait: {ros__parameters: {gain: 1.0}}',
        '/**: {ros__parameters: {gain: 1.0}}',
        'hip_controller: {ros__parameters: {anything: 1.0}}',
        '/b/gait: {ros__parameters: {gain: 1.0}}\n/**/gait: {ros__parameters: {limit_deg: 1.0}}',
        'rviz: {ros__parameters: {anything: {nested: 1.0}}}',
        '',
    ],
)
def test_what_is_taken_or_meant_for_others_is_accepted(tmp_path, text):
    assert check(tmp_path, text, '/gait') == []


@pytest.mark.parametrize(
    ('text', 'node', 'says'),
    [
        (
            'gait: {ros__parameters: {gain: 1.0}}',
            '/a/gait',
            '/gait is not /a/gait; accepted: /**/gait',
        ),
        ('a: {gait: {ros__parameters: {gain: 1.0}}}', '/b/gait', '/a/gait is not /b/gait'),
        ('/**/gaits: {ros__parameters: {gain: 1.0}}', '/gait', '/**/gaits is not /gait'),
        (
            'gait: {ros__parameters: {gian: 1.0}}',
            '/gait',
            'gian: no such parameter; accepted: gain',
        ),
        ('gait: {ros__parameters: {gain: {p: 1.0}}}', '/gait', 'gain.p: no such parameter'),
    ],
)
def test_what_nobody_takes_is_refused(tmp_path, text, node, says):
    with pytest.raises(ParameterError) as refusal:
        check(tmp_path, text, node)
    assert says in str(refusal.value)
    assert 'file.yaml' in str(refusal.value)


def test_a_name_near_that_of_another_node_is_that_node(tmp_path):
    text = 'hip_controller: {ros__parameters: {gain: 1.0}}'
    assert check(tmp_path, text, '/hop_controller') == []


def test_a_parameter_for_all_that_this_node_lacks_is_a_warning(tmp_path):
    (warning,) = check(tmp_path, '/**: {ros__parameters: {seed: 1, gain: 2.0}}', '/gait')
    assert 'file.yaml: /**: seed: not a parameter of this node' in warning


def test_files_are_those_that_the_flag_names():
    arguments = ['gait', '--ros-args', '--params-file', 'a', '-p', 'x:=1', '--params-file', 'b']
    assert files_in(arguments) == ['a', 'b']
    with pytest.raises(ParameterError, match='accepted: --ros-args --params-file c'):
        files_in(['gait', '--params-file', 'c'])


@pytest.mark.parametrize(
    'text', ['a: [', 'a: 2001-99-99', 'a: !!bool b', 'a: !!timestamp b', 'a: !!python/name:os']
)
def test_what_is_no_parameter_file_is_one_line(tmp_path, text):
    file = tmp_path / 'parameters.yaml'
    file.write_text(text)
    with pytest.raises(ParameterError, match='accepted: a ROS 2 parameter file') as refused:
        read_blocks(str(file))
    assert '\n' not in str(refused.value) and str(refused.value).startswith(str(file))
