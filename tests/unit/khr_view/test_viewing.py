"""The thread of the live page: it ends with its run, and its errors end nothing else."""

from khr_view.viewing import in_thread


def test_an_error_of_the_page_is_reported_and_the_run_goes_on():
    lines = []
    with in_thread(lambda _: 1 / 0, lines.append):
        lines.append('the run')
    assert sorted(lines) == [
        'khr: the page has stopped: ZeroDivisionError: division by zero',
        'the run',
    ]


def test_the_page_is_asked_to_stop_at_the_end_of_its_run():
    stopped = []
    with in_thread(lambda stop: stopped.append(stop.wait(30.0)), print):
        assert not stopped
    assert stopped == [True]
