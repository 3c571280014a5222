"""Parameters of a running graph, as they are shown and read back."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from khr_bringup.live import LiveParameter
from khr_bringup.scenario import parse_value

SCALARS = (
    st.booleans()
    | st.integers(-(2**63) + 1, 2**63 - 1)
    | st.floats(allow_nan=False)
    | st.text(st.characters(codec='utf-8', categories=('L', 'N', 'P', 'S', 'Zs')))
)


@pytest.mark.parametrize(
    ('node', 'name', 'value'),
    [
        ('simulator', 'friction', 1e-05),
        ('simulator', 'push_link', ''),
        ('simulator', 'push_link', 'true'),
        ('simulator', 'push_point', [0.0, 1e-05, -3.0]),
        ('ankle_controller', 'enabled', True),
        ('another_node', 'label', 'true'),
        ('another_node', 'label', 'a, b: [c] # d'),
        ('another_node', 'labels', ['', '1', 'no']),
        ('another_node', 'path', 'a long one ' * 30),
    ],
)
def test_what_is_shown_can_be_set(node, name, value):
    again = parse_value(node, name, LiveParameter(name, value, '').shown)
    assert (again, type(again)) == (value, type(value))


@given(SCALARS | st.lists(SCALARS))
def test_whatever_is_shown_is_one_line_of_yaml(value):
    shown = LiveParameter('name', value, '').shown
    assert '\n' not in shown
    assert yaml.safe_load(f'name: {shown}  # its meaning') == {'name': value}
