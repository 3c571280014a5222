"""A progress bar on a terminal, and its lines elsewhere."""

from io import StringIO

import pytest
from rich.console import Console

from khr_bringup.result import Progress
from khr_sweeps import progress
from khr_sweeps.progress import ProgressBar, show_run


@pytest.fixture
def console():
    return Console(file=StringIO(), force_terminal=True, width=200)


def test_a_run_is_shown_before_anything_is_simulated(console):
    with ProgressBar(total=11.55, unit='s', console=console) as bar:
        bar.show('starting', 0.0)
        assert 'starting' in console.file.getvalue()
        assert '0.00 of 11.55 s' in console.file.getvalue()
        show_run(bar, Progress(4.2, 'running', 1.5, 0.25, '1.7 Hz'))
    shown = console.file.getvalue()
    assert '4.20 of 11.55 s  x1.50  pitch rate 0.250 rad/s  peak 1.7 Hz' in shown
    assert shown.count('\x1b[?25l') == shown.count('\x1b[?25h'), 'the cursor comes back'


def test_results_printed_beside_a_bar_go_to_stdout(console, capsys):
    with ProgressBar(total=5.0, console=console) as bar:
        bar.advance()
        print('the result')
    assert capsys.readouterr().out == 'the result\n'
    assert 'the result' not in console.file.getvalue()


def test_a_bar_needs_no_stdout(console, monkeypatch):
    monkeypatch.setattr('sys.stdout', None)  # as of a command whose stdout is closed
    with ProgressBar(total=5.0, console=console) as bar:
        bar.advance()


def test_a_bar_that_is_quiet_or_never_used_shows_nothing(console):
    with ProgressBar(total=5.0, console=console):
        pass
    with ProgressBar(total=5.0, console=console, quiet=True) as bar:
        bar.advance()
    assert console.file.getvalue() == ''


def test_elsewhere_there_are_lines_at_intervals_if_asked_for(monkeypatch, capsys):
    now = iter(range(0, 1000, 10))
    monkeypatch.setattr(progress.time, 'monotonic', lambda: next(now))
    for total, lines, final in ((2, True, False), (2, False, False), (4, True, True)):
        with ProgressBar('tune', total, lines=lines, final=final) as bar:
            bar.expect(2)
            for _ in range(3):
                bar.advance()
    assert (
        capsys.readouterr().err.splitlines()
        == ['tune: 1 of 4, 0:01:00 left', 'tune: 3 of 4, 0:00:13 left'] * 2
    )
    with ProgressBar('tune', 10, lines=True, final=True) as bar:
        bar.skip(8)  # finished before: they do not count as computed now
        for _ in range(2):
            bar.advance()
    assert capsys.readouterr().err == 'tune: 10 of 10, 0:00:00 left\n'
