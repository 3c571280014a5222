"""The line of progress, as a terminal has it."""

from io import StringIO

import pytest
from rich.console import Console

from khr.cli.progress import SecondsLine
from khr_bringup.result import Progress


@pytest.fixture
def console():
    return Console(file=StringIO(), force_terminal=True, width=200)


def test_a_run_is_on_show_before_anything_is_simulated(console):
    with SecondsLine(console, 11.55) as line:
        line.show('starting', 0.0)
        assert 'starting' in console.file.getvalue()
        assert '0.00 of 11.55 s' in console.file.getvalue()
        line.show_run(Progress(4.2, 'running', 1.5, 0.25, '1.7 Hz'))
    shown = console.file.getvalue()
    assert '4.20 of 11.55 s  x1.50  pitch rate 0.250 rad/s  peak 1.7 Hz' in shown


def test_each_part_of_a_work_has_its_own_length(console):
    with SecondsLine(console) as line:
        line.show('repeating', 1.0, 5.0)
        line.show('drawing', 2.0, 3.0)
    assert 'repeating' in console.file.getvalue()
    assert '2.00 of 3.00 s' in console.file.getvalue()


def test_what_never_begins_shows_nothing(console):
    with SecondsLine(console, 5.0):
        pass
    assert console.file.getvalue() == ''
