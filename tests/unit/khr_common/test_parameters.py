"""A parameter table accepts its ranges and refuses the rest in one line."""

import math
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common import ParameterError, build, check, parameter, specifications


@dataclass(frozen=True)
class Table:
    gain: float = parameter(12.0, 'A gain.', '[0, 60] board')
    count: int = parameter(3, 'A count.', '[1, inf]')
    surface: str = parameter('smooth', 'A surface.', choices=('smooth', 'rubber'))
    enabled: bool = parameter(True, 'A switch.', read_only=True)
    point: tuple[float, ...] = parameter((0.0, 0.0, 0.1), 'A point.', 'm', length=3)


@given(st.floats() | st.floats(0.0, 60.0))
def test_a_number_within_its_range_is_accepted_and_others_are_refused(value):
    if 0.0 <= value <= 60.0:
        assert build(Table, {'gain': value}).gain == value
        return
    with pytest.raises(ParameterError) as refusal:
        check(Table, 'gain', value)
    assert str(refusal.value).count('\n') == 0
    assert '[0, 60] board' in str(refusal.value)


def test_defaults_are_accepted_and_lists_become_tuples():
    defaults = {name: each.default for name, each in specifications(Table).items()}
    assert defaults['point'] == [0.0, 0.0, 0.1]
    assert build(Table, defaults) == Table()


@pytest.mark.parametrize(
    ('name', 'value', 'says'),
    [
        ('gain', 12, 'write 12.0'),
        ('gain', '12', "'12'"),
        ('count', 3.0, 'integer'),
        ('count', True, 'integer'),
        ('count', 0, '[1, inf]'),
        ('surface', 'ice', 'smooth | rubber'),
        ('enabled', 1, 'bool'),
        ('point', [0.0, 1.0], '3 of them'),
        ('point', [0.0, 1.0, math.inf], 'inf'),
        ('gian', 1.0, 'gain, count'),
    ],
)
def test_refusal_names_parameter_value_and_what_is_accepted(name, value, says):
    with pytest.raises(ParameterError) as refusal:
        check(Table, name, value)
    assert name in str(refusal.value)
    assert says in str(refusal.value)
