"""An outcome as texts: what is written is read again, and what is no outcome is refused."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from khr_analysis.outcome import Outcome
from khr_analysis.outcome_measures import Slides
from khr_analysis.outcome_text import outcome_of, quantities
from khr_common.run_identity import MalformedError

number = st.floats(-1e6, 1e6)
OUTCOME = Outcome('walked', 13.6, None, 1.2, 0.1, 0.3, 0.02, 0.01, 0.1)


@given(number, st.none() | number, st.lists(number, min_size=6, max_size=6))
def test_what_is_written_is_read_again(time, fell_at, numbers):
    texts = quantities(Outcome('fell', time, fell_at, *numbers))
    assert quantities(outcome_of('fell', texts)) == texts


def test_slides_per_step_are_there_if_there_were_steps():
    assert 'step_slide_m' not in quantities(OUTCOME)
    walked = OUTCOME._replace(slides=Slides(0.001, 0.0023, 0.004, 9))
    texts = quantities(walked)
    assert (texts['steps'], texts['step_slide_m']) == ('9', '0.0023')
    assert outcome_of('walked', texts).slides == walked.slides


@given(st.sampled_from(sorted(quantities(OUTCOME))), st.text() | st.sampled_from(['nan', '-inf']))
def test_a_quantity_is_a_number_or_the_message_is_refused(name, text):
    values = quantities(OUTCOME) | {name: text}
    try:
        found = outcome_of('walked', values)
    except MalformedError as error:
        assert name in str(error)
    else:
        assert found.verdict == 'walked' and float(text) == float(text)


@pytest.mark.parametrize('verdict', ['', 'flew', 'fell\n'])
def test_a_verdict_is_one_of_four(verdict):
    with pytest.raises(MalformedError, match='verdict'):
        outcome_of(verdict, quantities(OUTCOME))
