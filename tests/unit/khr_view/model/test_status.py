"""The state of a run as text, and when it restarts."""

import math

import pytest

from khr_analysis.outcome import Outcome, SensedOutcome
from khr_analysis.outcome_values import values_of
from khr_balance.gaits.gait import gait_of
from khr_balance.gaits.gait_parameters import GaitParameters
from khr_view.model.status import (
    NO_RUN,
    STANDING,
    THEN,
    GaitMotion,
    Status,
    motion_in,
    motion_of,
    over,
    state_text,
)
from khr_view.session import PAUSE, RestartTimer

WALK = GaitMotion('walking', 11.6, 2.31)


def status(state='running', verdict='walked', fell_at=None):
    return Status(state=state, outcome=SensedOutcome(verdict, 13.6, fell_at, 0.0, 0.0))


@pytest.mark.parametrize(
    ('told', 'time', 'words'),
    [
        (status('waiting'), 0.0, 'starting'),
        (status(), 4.2, 'walking, 4.2 of 11.6 s'),
        (status('paused'), 4.2, 'paused at 4.2 s'),
        (status(fell_at=6.21), 6.3, 'fell at 6.2 s: press Restart'),
        (status(fell_at=6.21), 0.4, 'walking, 0.4 of 11.6 s'),
        (status(), 12.0, 'finished, walked: press Restart'),
        (status('finished'), 5.0, 'finished, walked: press Restart'),
    ],
)
def test_the_state_is_told(told, time, words):
    assert state_text(told, WALK, time, 'never') == words


def test_what_stands_is_never_over_and_what_comes_next_is_said():
    assert state_text(status(), STANDING, 99.0, 'same') == 'standing, 99.0 s'
    assert state_text(status(), GaitMotion(), 1.0, 'same') == 'running, 1.0 s'
    for how, words in THEN.items():
        assert state_text(status(), WALK, 12.0, how).endswith(words)
    assert state_text(status(), WALK, 12.0, None) == 'finished, walked'


def test_only_what_runs_or_has_finished_is_over():
    assert over(status('finished'), WALK, 0.0) and over(status(), WALK, WALK.end)
    assert not over(status(), WALK, WALK.end - 0.1)
    for state in ('paused', 'waiting', NO_RUN):
        assert not over(status(state), WALK, 30.0)


def test_a_motion_ends_with_its_gait():
    for motion in ('walk', 'leg_lift'):
        parameters = GaitParameters(motion=motion)
        assert motion_of(parameters).end == gait_of(parameters).duration
    assert motion_of(GaitParameters()).cycle == GaitParameters().cycle_period
    assert motion_of(GaitParameters(motion='leg_lift')).cycle == 0.0
    assert motion_in({'motion': 'stand'}) == STANDING
    assert motion_in({'cycles': 3}) == GaitMotion()


def test_a_finished_run_restarts_after_a_pause():
    timer = RestartTimer()
    assert not timer.due(over=False, now=0.0)
    assert not timer.due(over=True, now=10.0)
    assert not timer.due(over=True, now=10.0 + PAUSE / 2)
    assert timer.due(over=True, now=10.0 + PAUSE)
    assert not timer.due(over=False, now=100.0)
    assert not timer.due(over=True, now=101.0)


def test_status_shows_what_is_there_in_the_same_rows_from_the_start():
    status = Status(factor=math.nan)
    rows = dict(status.rows(1.0, over=False))
    assert rows['verdict so far'] == 'not yet' and rows['slip'] == rows['speed'] == '-'
    assert dict(status.rows(1.0, over=True))['verdict'] == 'not yet'
    values = values_of(Outcome('slipped', 1.0, None, 0.0, 0.0, 0.0, 0.0123, 0.0, 0.0))
    status.monitor('slipped', values | {'real_time_factor': '2.00'})
    assert list(dict(status.rows(1.0, over=False))) == list(rows)
    status.simulator({'sync': 'realtime'})
    assert status.late == '', 'a driver need not count late periods'
    status.simulator({'sync': 'realtime', 'missed_periods': '3', 'stale_corrections': '1'})
    status.stage, status.scenario = 2, 'walk_0deg'
    rows = dict(status.rows(1.0, over=False))
    assert rows['scenario'] == 'walk_0deg'
    assert rows['slip'] == '12.3 mm' and rows['stage'] == '2'
    assert rows['late'] == '3 periods, 1 corrections'
    status.simulator({'sync': 'lockstep'})
    assert 'late' not in dict(status.rows(1.0, over=False))
    status.monitor('fell', values_of(Outcome('fell', 1.0, 0.96, *[0.0] * 6)))
    assert dict(status.rows(1.0, over=True))['verdict'] == 'fell at 1.0 s'
