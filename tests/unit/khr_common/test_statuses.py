"""A value of a message is a finite number or is refused; nothing else is raised."""

from math import isfinite

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_common.errors import MalformedError
from khr_common.statuses import integer, real

TEXTS = st.text() | st.sampled_from(
    ['', 'nan', '-inf', '1e999', '1e308', '1_0', ' 3 ', '٣', '0x1', '9' * 50, '\ud800', '-0']
)
VALUES = st.none() | st.booleans() | st.floats() | st.integers() | st.lists(TEXTS) | TEXTS
MAPPINGS = st.just({}) | VALUES.map(lambda value: {'time': value})


@pytest.mark.parametrize('read', [integer, real])
@given(MAPPINGS)
def test_a_value_is_a_finite_number_or_refused(read, values):
    try:
        found = read(values, 'time')
    except MalformedError as error:
        assert str(error).startswith('time is ') and str(error).isprintable()
    else:
        assert isfinite(found) and not isinstance(values['time'], bool | list)


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(-(10**15), 10**15))
def test_what_was_written_is_read(number, count):
    for values in ({'x': number, 'n': count}, {'x': str(number), 'n': str(count)}):
        assert real(values, 'x') == number and integer(values, 'n') == count
