"""When a run is over: every listener has acknowledged its last instant, and it has been judged."""

import time
from dataclasses import replace

from khr_bringup.following import PATIENCE, _unfinished
from khr_bringup.run_monitor import View

END = 12_000_000_000
VIEW = View(
    state='finished',
    state_values={'time_ns': str(END), 'end': 'duration'},
    outcome={'final': 'true'},
    listeners=('monitor', 'recorder'),
    received={'monitor': END, 'recorder': 7_170_000_000},
)


def long_ago():
    return time.monotonic() - PATIENCE - 1.0


def test_a_listener_that_is_behind_is_waited_for_and_then_named():
    assert not VIEW.over
    assert _unfinished(replace(VIEW, news=time.monotonic())) is None
    text = _unfinished(replace(VIEW, news=long_ago()))
    assert text == 'the run ended, but not all of it was received: recorder up to t = 7.170 s'


def test_a_run_that_all_have_acknowledged_is_over_once_it_is_judged():
    complete = replace(VIEW, received=dict.fromkeys(VIEW.listeners, END))
    assert complete.over
    unjudged = replace(complete, outcome={'final': 'false'}, news=long_ago())
    assert not unjudged.over
    assert _unfinished(unjudged) == 'the monitor did not judge the run'


def test_a_run_that_goes_on_is_not_over():
    assert not replace(VIEW, state='running').over
    assert _unfinished(replace(VIEW, state='running', news=long_ago())) is None
