"""Lockstep: what counts as an answer and to which instant, and for how long a run waits."""

import pytest

from khr_sim.lockstep import ASK_AGAIN, KEPT, LEAD, SILENCE, Barrier, Lockstep, Receipts


def barrier():
    return Barrier(['gait', 'ankle_controller'])


def test_missing_until_every_source_has_answered():
    b = barrier()
    b.open(0)
    assert b.missing() == ['gait', 'ankle_controller']
    assert b.put('gait', 0, 'g')
    assert b.missing() == ['ankle_controller']
    assert b.take() is None
    b.put('ankle_controller', 0, 'a')
    assert b.missing() == []
    assert b.take() == {'gait': 'g', 'ankle_controller': 'a'}


def test_answers_are_taken_once_and_are_no_longer_missing():
    b = Barrier(['gait'])
    b.open(0)
    b.put('gait', 0, 'g')
    assert b.take() == {'gait': 'g'}
    assert b.take() is None and b.missing() == []
    assert not b.put('gait', 0, 'again')


def test_first_of_two_answers_counts():
    b = barrier()
    b.open(0)
    b.put('gait', 0, 'first')
    b.put('gait', 0, 'second')
    assert b.given()['gait'] == b.first('gait', 0) == 'first'
    assert b.first('ankle_controller', 0) is None


def test_an_answer_is_known_for_a_while_after_it_has_been_taken():
    b = Barrier(['gait'])
    for instant in range(0, KEPT + 1):
        b.open(instant)
        b.put('gait', instant, f'{instant}')
        b.take()
    assert [b.first('gait', instant) for instant in (0, 1, KEPT)] == [None, '1', f'{KEPT}']


def test_answer_to_an_instant_that_has_not_been_is_refused():
    b = barrier()
    b.open(0)
    assert not b.put('gait', 15, 'from an earlier run')
    b.open(15)
    assert b.missing() == ['gait', 'ankle_controller']


def test_answers_are_taken_in_the_order_of_their_instants():
    b = Barrier(['gait'])
    b.open(0)
    b.open(15)
    b.put('gait', 15, 'newer')
    assert b.asked_ns == 0 and b.missing() == ['gait'] and b.take() is None
    b.put('gait', 0, 'older')
    assert (b.take(), b.take()) == ({'gait': 'older'}, {'gait': 'newer'})


def test_the_instant_before_stays_open_and_older_ones_do_not():
    b = barrier()
    for stamp in (0, 15, 30):
        b.open(stamp)
    assert b.put('gait', 15, 'late')
    assert not b.put('gait', 0, 'too late')
    assert (b.asked_ns, b.given()) == (15, {'gait': 'late'})


def test_newest_answers_are_kept_whatever_their_instant():
    b = barrier()
    for stamp in (0, 15, 30, 45):
        b.open(stamp)
    b.put('gait', 0, 'old')
    assert b.newest == {'gait': 'old'}


def test_who_has_not_received_enough_is_known():
    receipts = Receipts(['recorder', '', 'page'])
    assert receipts.absent() == ['recorder', 'page']
    assert receipts.take('recorder', 0, 0)
    assert receipts.absent() == ['page']
    assert receipts.take('page', 20, 30)
    assert receipts.behind(20) == {'recorder': 0}
    assert receipts.behind(30) == {'recorder': 0, 'page': 20}
    assert receipts.behind(0) == {}


def test_a_report_about_a_later_sample_or_of_a_stranger_does_not_count():
    receipts = Receipts(['recorder'])
    assert not receipts.take('stranger', 0, 0)
    assert not receipts.take('recorder', 90, 15)
    assert receipts.absent() == ['recorder']


class WallClock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return WallClock()


@pytest.fixture
def lockstep(clock):
    return Lockstep(['gait'], ['recorder'], clock)


def test_a_run_waits_for_answers_and_listeners_until_it_starts(lockstep, clock):
    assert lockstep.absent() == ['gait', 'recorder']
    clock.now += 3.0
    assert lockstep.never_started(3.0) == ''
    clock.now += 0.1
    assert lockstep.never_started(3.0) == 'gait, recorder did not appear within 3 s'
    assert lockstep.never_started(0.0) == ''  # waits for ever


def test_it_asks_again_and_gives_up_on_a_missing_answer(lockstep, clock):
    assert not lockstep.asks()
    clock.now += 1.01 * ASK_AGAIN
    assert lockstep.asks()
    assert lockstep.late(5.0, ready=False) == ''
    clock.now += 5.0
    assert lockstep.late(5.0, ready=False) == (
        'no answer from gait for t = 0.000 s within 5 s of wall time'
    )
    lockstep.reported()
    assert not lockstep.asks()


def test_it_waits_for_a_listener_that_is_far_behind(lockstep, clock):
    lockstep.receipts.take('recorder', 0, 0)
    lockstep.barrier.open(LEAD)
    assert lockstep.missing(ready=True) == []
    lockstep.barrier.open(LEAD + 1)
    assert lockstep.missing(ready=True) == ['recorder']
    clock.now += 6.0
    assert lockstep.late(5.0, ready=True) == (
        'not received whole by recorder after t = 0.000 s within 5 s of wall time'
    )


def test_a_run_is_received_when_its_end_is_or_when_nobody_reports_any_more(lockstep, clock):
    lockstep.barrier.open(15)
    assert not lockstep.received()
    lockstep.receipts.take('recorder', 15, 15)
    assert lockstep.received()
    lockstep.barrier.open(30)
    assert not lockstep.received()
    clock.now += 1.01 * SILENCE
    assert lockstep.received()
