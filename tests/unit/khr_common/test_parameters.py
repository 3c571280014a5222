"""Values within their ranges are accepted; others are refused in one line with what is accepted."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common import KhrError, ParameterError, build, check, checks, parameter, specifications


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
    assert check(Table, 'count', 2**63 - 1) == 2**63 - 1


@pytest.mark.parametrize(
    ('name', 'value', 'says'),
    [
        ('gain', 12, 'write 12.0'),
        ('gain', '12', "'12'"),
        ('count', 3.0, 'integer'),
        ('count', True, 'integer'),
        ('count', 0, '[1, inf]'),
        ('count', 2**63, 'beyond 64 bits'),
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


NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ('check', 'bounds', 'accepted', 'refused', 'text'),
    [
        (checks.positive, (), [1e-300, 2.0], [0.0, -1.0, INF, NAN], r'(0, inf)'),
        (checks.non_negative, (), [0.0, 2.0], [-1e-300, INF, NAN], r'[0, inf)'),
        (checks.finite, (), [-1e300, 0.0], [INF, -INF, NAN], r'(-inf, inf)'),
        (checks.between, (1, 2, 'Hz'), [1.5], [1, 2, NAN], r'(1, 2) Hz'),
        (checks.integer, (1, 3), [1, 3], [0, 4], r'integer in [1, 3]'),
        (checks.one_of, (('a', 'b'),), ['a'], ['c', 1], r'a | b'),
        (
            checks.within,
            (-1, 1),
            [1.0, np.array([-1.0, 0.0])],
            [NAN, 1.1, np.array([0.0, -1.1])],
            r'[-1, 1]',
        ),
    ],
)
def test_a_check_refuses_what_is_outside_and_says_what_is_accepted(
    check, bounds, accepted, refused, text
):
    for value in accepted:
        check('size', value, *bounds)
    for value in refused:
        with pytest.raises(KhrError, match=r'^size: ') as refusal:
            check('size', value, *bounds)
        assert str(refusal.value).endswith(f'is not accepted; accepted: {text}')
