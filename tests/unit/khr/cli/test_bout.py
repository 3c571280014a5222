"""A bout on a page is repeated for a reader."""

from contextlib import nullcontext
from types import SimpleNamespace as Made

from khr.cli.verbs import bouts as verb
from khr_bringup.bout.bout import load_bout
from khr_bringup.graph.graph import RunOptions
from khr_view import viewing
from khr_view.viewing import Observer, Viewing


def test_a_bout_is_repeated_only_while_a_browser_is_connected(monkeypatch):
    display, done = Made(readers=0), []

    def look(_):
        done.append('waits')
        display.readers = 1

    def run(*_):
        done.append('runs')
        if len(done) > 3:
            raise KeyboardInterrupt
        display.readers = 0

    observer = Observer(nullcontext, [Made(display=display)])
    monkeypatch.setattr(viewing.time, 'sleep', look)
    monkeypatch.setattr(verb, '_run', run)
    monkeypatch.setattr(verb, 'live_page', lambda *_, **__: nullcontext(observer))
    assert verb.view_bout(load_bout('shove'), RunOptions(), None, Viewing(again='same')) == 0
    assert done == ['runs', 'waits', 'runs', 'waits', 'runs']
