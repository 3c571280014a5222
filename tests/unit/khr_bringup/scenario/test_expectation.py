"""What is expected of a run, and whether it came."""

import pytest

from khr_bringup.scenario import scenario as scenarios
from khr_bringup.scenario.expectation import Expectation
from khr_common.errors import KhrError
from khr_common.pacing import Punctuality

LOCKSTEP = scenarios.load_scenario('stand_0deg')
WALL_CLOCK = LOCKSTEP.changed({('simulator', 'sync'): 'realtime'})
HELD = Punctuality(periods=9).result()
NOT_HELD = Punctuality(periods=9, late=5).result()


@pytest.mark.parametrize(
    ('text', 'verdict', 'realtime', 'says'),
    [
        ('', 'fell', NOT_HELD, ''),
        ('walked', 'walked', NOT_HELD, ''),
        ('walked', 'fell', HELD, 'expected walked, the outcome is fell'),
        ('walked', '', None, 'expected walked, the outcome is unknown'),
        ('realtime', 'fell', HELD, ''),
        ('walked,realtime', 'walked', NOT_HELD, '5 of 9 periods late'),
        ('realtime, walked', 'fell', HELD, 'the outcome is fell'),
        ('realtime', 'walked', None, 'did not report'),
    ],
)
def test_what_is_expected_must_come(text, verdict, realtime, says):
    unmet = Expectation.parse(text, '--expect', WALL_CLOCK).unmet(verdict, realtime)
    assert says in unmet and bool(unmet) == bool(says) and '\n' not in unmet


@pytest.mark.parametrize('text', ['flown', 'walked,fell', 'realtime,', ','])
def test_what_is_no_outcome_is_refused(text):
    with pytest.raises(KhrError, match=r'--expect: .* walked \| stood .* realtime'):
        Expectation.parse(text, '--expect', WALL_CLOCK)


@pytest.mark.parametrize(('scenario', 'offline'), [(LOCKSTEP, False), (WALL_CLOCK, True)])
def test_real_time_is_expected_of_the_wall_clock_alone(scenario, offline):
    with pytest.raises(KhrError, match=r'simulator\.sync=realtime'):
        Expectation.parse('realtime', '--expect', scenario, offline)
