"""An outcome as numbers by name, and as texts: it is read back exactly, or refused."""

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_measures import Slides
from khr_analysis.outcome_values import labelled, outcome_of, values_of
from khr_common.errors import MalformedError

number = st.floats(-1e6, 1e6)
OUTCOME = Outcome('walked', 13.6, None, 1.2, 0.1, 0.3, 0.02, 0.01, 0.1)
slides = st.builds(Slides, number, number, number, st.integers(1, 99)) | number.map(Slides)
times = number, st.none() | number
outcomes = st.builds(
    Outcome, st.just('fell'), *times, number, number, number, number, number, number, slides
) | st.builds(SensedOutcome, st.just('upright'), *times, number, number)


@given(outcomes)
def test_an_outcome_is_read_back_bit_for_bit_from_a_file_and_from_a_message(outcome):
    values = values_of(outcome)
    for each in (json.loads(json.dumps(values)), {name: str(v) for name, v in values.items()}):
        assert outcome_of(outcome.verdict, each) == outcome


def test_people_read_degrees_and_no_slide_of_a_run_without_steps():
    texts = labelled(OUTCOME)
    assert texts['largest pitch, deg'] == '17.19' and texts['vibration, deg/s'] == '5.73'
    assert texts['distance along the surface, m'] == '1.2000'
    assert 'slide per step, m' not in texts and labelled(None) == {}
    walked = OUTCOME._replace(slides=Slides(0.001, 0.0023, 0.004, 9))
    assert labelled(walked)['slide per step, m'] == '0.0023' and labelled(walked)['steps'] == '9'


@given(st.sampled_from(sorted(values_of(OUTCOME))), st.text() | st.sampled_from(['nan', '-inf']))
def test_a_quantity_is_a_number_or_the_message_is_refused(name, text):
    values = values_of(OUTCOME) | {name: text}
    try:
        found = outcome_of('walked', values)
    except MalformedError as error:
        assert name in str(error)
    else:
        assert found.verdict == 'walked' and float(text) == float(text)
    with pytest.raises(MalformedError, match='verdict'):
        outcome_of(text, values_of(OUTCOME))
