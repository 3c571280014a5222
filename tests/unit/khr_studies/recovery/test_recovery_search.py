"""The search for the shape of the step: its candidates, its cost, resuming and its file."""

from __future__ import annotations

from concurrent.futures import Future

import pandas as pd
import pytest
from typer.testing import CliRunner

from khr.cli.app import app
from khr_balance.gaits.kinematics import GaitError
from khr_balance.recovery.parameters import RecoveryParameters
from khr_bringup.scenario.scenario import parse
from khr_common.errors import KhrError
from khr_studies.push.study import START
from khr_studies.recovery import search as searching
from khr_studies.recovery.search import RANGES, Search, attempt, search, summarise, write


class Pushed:
    """A pool without processes, and pushes that topple a robot by its step length alone."""

    workers = 1

    def __init__(self):
        self.runs = 0

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def submit(self, function, /, called, *arguments):
        done = Future()
        try:
            done.set_result(getattr(self, called.__name__)(*arguments))
        except Exception as error:
            done.set_exception(error)
        return done

    def limit_of_ankles(self, condition):
        return {'held': 1.0}

    def attempt(self, condition, impulse):
        self.runs += 1
        length = dict(condition.changes)['recovery', 'step_length'][1]
        fell = impulse > 10.0 * length
        return {'fell': fell, 'fell_at_s': START + 1.0 if fell else None}


@pytest.fixture
def pushed(monkeypatch):
    pool = Pushed()
    monkeypatch.setattr('khr_studies.measuring.kept_pool.local_pool', lambda *_: pool)
    return pool


def test_a_search_improves_on_the_default_and_resumes(pushed, tmp_path):
    asked = Search('front', 80)
    found = search(asked, 1, tmp_path)
    assert found.before < found.held <= found.pushes
    assert dict(zip(RANGES, found.values, strict=True))['step_length'] > 0.0672
    runs = pushed.runs
    assert search(asked, 1, tmp_path) == found
    assert pushed.runs == runs


def test_the_file_holds_what_was_found_and_the_default_of_the_other_direction(tmp_path):
    values = [low for low, _ in RANGES.values()]
    text = write([searching.Found(Search('front'), values, 3, 2, 27)], tmp_path)
    assert text.splitlines()[0] == 'front: 3 of 27 pushes held, 2 by the default'
    path = tmp_path / 'recovery.yaml'
    read = parse(path.read_text(), str(path), 'recovery').table(RecoveryParameters)
    for name, (low, _) in RANGES.items():
        assert getattr(read, name) == (getattr(RecoveryParameters(), name)[0], low)


def test_the_default_step_is_within_the_ranges_searched():
    for name, (low, high) in RANGES.items():
        assert all(low <= value <= high for value in getattr(RecoveryParameters(), name)), name


def test_an_early_fall_costs_more_than_a_late_one():
    runs = pd.DataFrame(
        {
            'candidate': [0, 0, 1, 1, 2, 2],
            'fell': [False, False, False, True, False, True],
            'fell_at_s': [None, None, None, START + 5.0, None, START + 0.5],
        }
    )
    (best, held), (late, one), (early, _) = summarise(runs)
    assert (best, held, one) == (0.0, 2, 1)
    assert 0.5 < late < early < 1.0


def test_a_step_out_of_reach_counts_as_a_fall(monkeypatch):
    def refuse(*_):
        raise GaitError('left leg: too short')

    monkeypatch.setattr(searching, 'push_once', refuse)
    assert attempt(Search('front'), 1.0)['fell']


@pytest.mark.parametrize(
    ('options', 'message'),
    [
        (['--search'], '--search: not accepted without --recovery'),
        (['--measured'], '--measured: not accepted without --recovery'),
        (['--seeds', '7'], '--seeds: not accepted without --recovery'),
        (['--recovery', '--search', '--ka', '18'], '--recovery: has pushes of its own'),
        (['--recovery', '--search', '--direction', 'left'], "--direction: 'left'"),
        (['--recovery', '--search', '--candidates', '3'], '--candidates: 3 is not accepted'),
    ],
)
def test_options_that_do_not_go_together_are_refused(options, message, tmp_path):
    done = CliRunner().invoke(app(), ['push', *options, '--out', str(tmp_path)])
    assert isinstance(done.exception, KhrError)
    assert str(done.exception).startswith(message)
    assert not [*tmp_path.iterdir()]
