"""Who goes first: what is granted is in force, and what is started later does not inherit it."""

import os
import threading

from khr_common.scheduling import ask_for_real_time


def in_thread(action):
    """Return what an action returns in a thread of its own."""
    found = []
    thread = threading.Thread(target=lambda: found.append(action()))
    thread.start()
    thread.join()
    return found[0]


def test_what_is_granted_is_in_force_for_this_thread_alone():
    def ask():
        granted = ask_for_real_time(1)
        own = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
        return granted, own, in_thread(lambda: os.sched_getscheduler(0))

    before = os.sched_getscheduler(0)
    granted, own, of_child = in_thread(ask)
    assert own == (os.SCHED_FIFO if granted else before)
    assert of_child == os.sched_getscheduler(0) == before


def test_nothing_is_asked_for_without_a_priority():
    before = os.sched_getscheduler(0)
    assert not ask_for_real_time(0)
    assert os.sched_getscheduler(0) == before
