"""The lockstep barrier: what counts as an answer, and to which instant."""

from khr_sim.lockstep import Barrier, Receipts


def barrier():
    return Barrier(['gait', 'ankle_controller'])


def test_missing_until_every_source_has_answered():
    b = barrier()
    b.open(0)
    assert b.missing(0) == ['gait', 'ankle_controller']
    assert b.put('gait', 0, 'g')
    assert b.missing(0) == ['ankle_controller']
    b.put('ankle_controller', 0, 'a')
    assert b.missing(0) == []
    assert b.at(0) == {'gait': 'g', 'ankle_controller': 'a'}


def test_first_of_two_answers_counts():
    b = barrier()
    b.open(0)
    b.put('gait', 0, 'first')
    b.put('gait', 0, 'second')
    assert b.at(0)['gait'] == 'first'


def test_answer_to_an_instant_that_has_not_been_is_refused():
    b = barrier()
    b.open(0)
    assert not b.put('gait', 15, 'from an earlier run')
    b.open(15)
    assert b.missing(15) == ['gait', 'ankle_controller']


def test_the_instant_before_stays_open_and_older_ones_do_not():
    b = barrier()
    for stamp in (0, 15, 30):
        b.open(stamp)
    assert b.put('gait', 15, 'late')
    assert not b.put('gait', 0, 'too late')
    assert b.at(0) == {}


def test_newest_answers_are_kept_whatever_their_instant():
    b = barrier()
    for stamp in (0, 15, 30, 45):
        b.open(stamp)
    b.put('gait', 0, 'old')
    assert b.newest() == {'gait': 'old'}


def test_who_has_not_received_enough_is_known():
    receipts = Receipts(['recorder', '', 'page'])
    assert receipts.absent() == ['recorder', 'page']
    assert receipts.take('recorder', 0, 0)
    assert receipts.absent() == ['page']
    assert receipts.take('page', 20, 30)
    assert receipts.behind(20) == {'recorder': 0}
    assert receipts.behind(30) == {'recorder': 0, 'page': 20}
    assert receipts.behind(0) == {}


def test_a_report_from_before_a_reset_or_of_a_stranger_does_not_count():
    receipts = Receipts(['recorder'])
    assert not receipts.take('stranger', 0, 0)
    assert receipts.take('recorder', 90, 90)
    receipts.begin()
    assert receipts.absent() == []  # it is still there
    assert not receipts.take('recorder', 90, 15)
    assert receipts.behind(15) == {'recorder': 0}
