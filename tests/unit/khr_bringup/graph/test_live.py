"""Parameters of a running graph, as they are shown and read back."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.graph.live import LiveParameter, check_change
from khr_bringup.scenario.parameter_file import parse_value
from khr_common.errors import KhrError

SCALARS = (
    st.booleans()
    | st.integers(-(2**63) + 1, 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text('aN0é😀\u3000 .,:;#&*!|>?%@`~=+-_/\'"\\()[]{}')
)


@pytest.mark.parametrize(
    ('node', 'name', 'value'),
    [
        ('simulator', 'friction', 1e-05),
        ('simulator', 'push_link', 'true'),
        ('simulator', 'push_point', [0.0, 1e-05, -3.0]),
        ('ankle_controller', 'enabled', True),
        ('another_node', 'label', 'a, b: [c] # d'),
        ('another_node', 'labels', ['', '1', 'no']),
        ('another_node', 'path', 'a long one ' * 30),
    ],
)
def test_a_value_that_is_shown_can_be_set(node, name, value):
    shown = LiveParameter(name, value, '')
    for again in (parse_value(node, name, shown.as_yaml), shown.read(node, shown.as_yaml)):
        assert (again, type(again)) == (value, type(value))


@pytest.mark.parametrize(
    ('value', 'text', 'read'),
    [
        (12.0, '14', 14.0),
        (12, '14', 14),
        ('a', '14', '14'),
        ([1.0], '[2, 3.5]', [2.0, 3.5]),
        ([], '[2]', [2]),
        (True, 'false', False),
    ],
)
def test_a_value_is_read_as_the_present_one(value, text, read):
    found = LiveParameter('gain', value, '').read('another_node', text)
    assert (found, type(found)) == (read, type(read))


@given(SCALARS | st.lists(SCALARS))
def test_every_value_is_shown_as_one_line_of_yaml(value):
    shown = LiveParameter('name', value, '').as_yaml
    assert '\n' not in shown
    assert yaml.safe_load(f'name: {shown}  # its meaning') == {'name': value}


def test_a_change_that_a_node_would_refuse_names_what_is_accepted():
    gain, seed = LiveParameter('gain', 12.0, ''), LiveParameter('seed', 0, '', fixed=True)
    check_change('ankle_controller', gain, 18.0)
    check_change('another_node', gain, 900.0)
    check_change('simulator', LiveParameter('use_sim_time', False, ''), True)
    with pytest.raises(KhrError) as refusal:
        check_change('ankle_controller', gain, 900.0)
    assert str(refusal.value) == (
        'ankle_controller: gain: 900.0 is not accepted; accepted: float in [0, 60]'
    )
    with pytest.raises(KhrError) as refusal:
        check_change('simulator', seed, 3)
    assert str(refusal.value) == (
        'simulator: seed: 3 is not accepted: fixed at 0 while it runs; accepted: '
        'khr run --set simulator.seed=VALUE'
    )
