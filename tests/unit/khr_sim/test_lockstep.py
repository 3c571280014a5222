"""Lockstep: what counts as an answer and to which instant, and for how long a run waits."""

import pytest

from khr_sim.lockstep import ASK_AGAIN, KEPT, LEAD, SILENCE, Barrier, Lockstep, Receipts


@pytest.fixture
def barrier():
    made = Barrier(['gait', 'ankle_controller'])
    made.open(0)
    return made


@pytest.fixture
def gait_alone():
    return Barrier(['gait'])


def test_the_first_answer_of_every_source_is_taken_once(barrier):
    assert barrier.missing() == ['gait', 'ankle_controller']
    assert barrier.put('gait', 0, 'g') and barrier.put('gait', 0, 'again')
    assert barrier.missing() == ['ankle_controller']
    assert barrier.take() is None and barrier.first('ankle_controller', 0) is None
    barrier.put('ankle_controller', 0, 'a')
    assert barrier.missing() == []
    assert barrier.take() == {'gait': 'g', 'ankle_controller': 'a'}
    assert barrier.take() is None and barrier.missing() == []
    assert not barrier.put('gait', 0, 'late')


def test_an_answer_is_known_for_a_while_after_it_has_been_taken(gait_alone):
    for instant in range(0, KEPT + 1):
        gait_alone.open(instant)
        gait_alone.put('gait', instant, f'{instant}')
        gait_alone.take()
    found = [gait_alone.first('gait', instant) for instant in (0, 1, KEPT)]
    assert found == [None, '1', f'{KEPT}']


def test_answer_to_an_instant_that_has_not_been_is_refused(barrier):
    assert not barrier.put('gait', 15, 'from an earlier run') and not barrier.newest
    barrier.open(15)
    assert barrier.missing() == ['gait', 'ankle_controller']


def test_answers_are_taken_in_the_order_of_their_instants(gait_alone):
    gait_alone.open(0)
    gait_alone.open(15)
    gait_alone.put('gait', 15, 'newer')
    assert gait_alone.asked_ns == 0 and gait_alone.missing() == ['gait']
    assert gait_alone.take() is None
    gait_alone.put('gait', 0, 'older')
    assert (gait_alone.take(), gait_alone.take()) == ({'gait': 'older'}, {'gait': 'newer'})


def test_the_instant_before_stays_open_and_older_ones_do_not(barrier):
    barrier.open(15)
    barrier.open(30)
    assert barrier.put('gait', 15, 'late')
    assert not barrier.put('gait', 0, 'too late')
    assert (barrier.asked_ns, barrier.given()) == (15, {'gait': 'late'})
    assert barrier.newest == {'gait': 'too late'}


def test_who_has_not_received_enough_is_known():
    receipts = Receipts(['recorder', '', 'page'])
    assert receipts.absent() == ['recorder', 'page']
    assert receipts.take('recorder', 0, 0) and receipts.take('page', 20, 30)
    assert receipts.absent() == []
    assert receipts.behind(0) == {}
    assert receipts.behind(20) == {'recorder': 0}
    assert receipts.behind(30) == {'recorder': 0, 'page': 20}
    assert not receipts.take('stranger', 0, 0)
    assert not receipts.take('recorder', 90, 15)  # about a sample that has not been
    assert receipts.behind(20) == {'recorder': 0}


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
