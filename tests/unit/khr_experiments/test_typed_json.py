"""Results read back as they were written, and what was not written so is no result."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_experiments.critical import Attempt, Condition
from khr_experiments.push_recovery import Bracket, PushResponse
from khr_experiments.typed_json import dumps, loads

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: (
        st.lists(inner)
        | st.lists(inner).map(tuple)
        | st.dictionaries(st.text() | st.integers() | st.tuples(st.text()), inner)
        | st.builds(Bracket, inner, inner)
    ),
)


@given(plain)
def test_results_read_back_the_same(value):
    assert loads(dumps(value)) == value


def test_arrays_and_dataclasses_keep_their_types():
    response = PushResponse(np.array([0.0, 0.1]), np.array([-0.0, np.nan]), True)
    again = loads(dumps((response, Condition(ankle_gain=12.0))))
    assert type(again[0]) is PushResponse and again[1] == Condition(ankle_gain=12.0)
    assert again[0].time.tobytes() == response.time.tobytes()
    assert again[0].x_com.tobytes() == response.x_com.tobytes()
    assert Attempt.__module__.startswith('khr_')


@pytest.mark.parametrize(
    'value',
    [
        {'kind': ['os', 'system'], 'fields': {'command': 'true'}},
        {'kind': ['khr_experiments.job_cache', 'hashlib'], 'fields': {}},
        {'kind': ['khr_experiments.job_cache', 'compute_and_keep'], 'fields': {'path': 'x'}},
        {'kind': ['khr_experiments.no_such_module', 'X'], 'fields': {}},
        {'kind': ['khr_experiments.critical', 'Condition'], 'fields': {'no_such': 1}},
        {'array': [1.0], 'dtype': 'O'},
        {'something': 'else'},
    ],
)
def test_what_is_no_result_of_this_project_is_refused(value):
    with pytest.raises(ValueError, match=r'.'):
        loads(json.dumps([value]))


def test_what_cannot_be_read_back_is_not_written():
    with pytest.raises(TypeError, match='accepted: plain data'):
        dumps(object())
